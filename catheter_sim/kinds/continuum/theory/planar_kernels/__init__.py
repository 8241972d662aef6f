"""Static models of planar robots in compiled form: many robots along their inputs.

`tension_march` is `fkm_exact_arm` for one pair of tendons, `sliding_march` is `fkm_sliding`: the same
equations as in `exact_arm` and `sliding` in plain Python, which the tests hold them to.
"""
