"""What top and motor share: a ball on a plane, and the dynamics of rigid bodies."""
