"""Environments for Gymnasium, which is installed by `pip install magmotor[gym]`.

Importing this module registers them. Gymnasium does so itself for a name that begins with the
module: `gymnasium.make("magmotor.gym:magmotor/Levitation-v0")`.
"""

try:
    import gymnasium
except ImportError:
    raise ImportError("there is no gymnasium: pip install magmotor[gym]") from None

gymnasium.register(
    "magmotor/Levitation-v0",
    entry_point="magmotor.gym.levitation:Levitation",
    vector_entry_point="magmotor.gym.levitation:LevitationVector",
    max_episode_steps=1000,
)
