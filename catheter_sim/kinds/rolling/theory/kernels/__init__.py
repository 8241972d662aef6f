"""The complete balance in compiled form: link by link, Newton's method, friction's history.

The same as `newton_euler`, `virtual_work` and `rods` in plain NumPy, which the tests hold it to; here for one
configuration after another.

Arrays. `joint`, shape (n, 12), `rod`, shape (m, n, 7), `stiffness`, shape (m,): see `packed` and the names in
`columns`. Loads as in `loads.Loads`.
"""
