"""Which inputs bring a robot where it should be, where it can be, and where it is: questions to its twin."""
