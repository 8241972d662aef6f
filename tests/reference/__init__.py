"""Second solvers and finer models that the tests hold the package against."""
