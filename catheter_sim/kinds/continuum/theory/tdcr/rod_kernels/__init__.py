"""Equilibria of a Cosserat rod with tendons in compiled form: sections, balance, continuation.

`collocation` solves the same equations as they are printed, in plain NumPy and SciPy; the tests hold the
one to the other.

`section` integrates the rod between two disks, `tendon_forces` adds what tendons pull there, `balance` says
what each disk lacks, `newton` brings that to zero, `friction` finds tensions and posture in turns, and
`continuation` follows an equilibrium from load to load; `together` does so for eight rows at once, where one
step from rest leads there. `path_lengths` measures what came out.

Strains are (u, v - e_z), wrenches (moment, force), six numbers in this order, in the body's frame. A
compliance of zero locks a strain.

Where tendons run along the whole section (fully constrained paths) the wrench is that of the rod and of its
tendons together. The tendons' own share, T_k t_k along the unit tangents t_k ~ v + u x r_k of Rao et al.
2021 (doi 10.3389/frobt.2020.630245), Eq. 27, then belongs to the elastic law: it is the derivative of sum
T_k |v + u x r_k|, convex in the strains as the rod's energy is, so that each wrench belongs to one strain.
The tendons' distributed force (Eq. 28, with p'' for the p' printed in its second place) and the forces
where they end (Eqs 24-25) are then inside and balance by themselves. So do, on the path LUMENS, the forces
of passing tendons where the strains jump, and their paths' directions with them: at a segment's end and at
a loaded disk. Eqs 40-41 leave these forces out, and CONTINUOUS takes them away again.
"""
