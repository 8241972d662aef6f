"""Sound measurements, spoiled as people spoil them, to see what a diagnosis makes of them.

Robots, trials, noise and hidden causes are those of the independent bench (`blind_bench.nature`). Nothing
here imports `diagnosis`: what is wrong with the data is written apart from the checks that look for it.
"""
