"""How often one more experiment settles what first data could not: a proposed, a fixed, a random one."""
