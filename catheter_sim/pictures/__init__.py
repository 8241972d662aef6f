"""Pictures and videos without a screen."""
