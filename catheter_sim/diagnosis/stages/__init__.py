"""The steps of a diagnosis, a file each, in the order in which `pipeline` calls them.

prepare, pose, calibrate, find_data_faults, acquit_trials, choose_causes, decide_on_heldout, examine,
score_hypotheses, judge, replay_in_mujoco, conclude, plan_next_experiment, widen_intervals, assemble.
`run` holds what they share.
"""
