"""The transseptal implantation of a clip on the mitral valve: anatomy, plan, scene, steps, outcome."""
