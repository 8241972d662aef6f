"""What `import catheter_sim` offers: functions on robots, runs and data, and results that become tables."""
