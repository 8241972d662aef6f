"""The look of the pages that this package writes: one style, and a template that others fill."""
