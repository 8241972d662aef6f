"""The equations of `arc_equilibrium` in compiled loops: one robot after another, row after row.

`loads` says what loads do to the bends, `balance` what is left over at given bends, `newton` brings that to
zero, `history` goes from row to row.
"""
