"""The kinetostatic model in compiled form: arcs in space, superelastic fibres, capstan friction with history.

Every notch is a piece of a helix: its strip's centroid line turns by the rotation vector w from the notch's
lower edge to its upper one, evenly, and stretches by the share e. Energy: fibres of the section, each at the
strain e - x (w_y - rest) / h + y (w_x - rest) / h, and torsion. The tendon runs straight from edge to edge at
x = its radius. What balances is virtual work by w and e of every notch. e is eliminated notch by notch.

Arrays: n notches, f fibres, p points that are loaded, r rows, B robots. `notch`, shape (n, 14), and `drive`,
(4,): see `columns`. `fibre`, (n, f, 3): x from the centroid, y, area. `metal`, (4,): modulus, strains at
which the plateaus begin in tension and in compression, share of the modulus that the plateau loses.
"""
