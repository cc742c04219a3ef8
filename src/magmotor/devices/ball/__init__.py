"""Code shared by top and motor: a ball on a plane, and the dynamics of rigid bodies."""
