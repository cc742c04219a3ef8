"""Environments for Gymnasium, which is installed by `pip install "magmotor[gym]"`.

Importing this module registers them. Gymnasium does so itself for a name that begins with the
module: `gymnasium.make("magmotor.gym:magmotor/Levitation-v0")`.
"""

from magmotor.common.optional import extra

with extra("gym"):
    import gymnasium

gymnasium.register(
    "magmotor/Levitation-v0",
    entry_point="magmotor.gym.levitation:Levitation",
    vector_entry_point="magmotor.gym.levitation:LevitationVector",
    max_episode_steps=1000,
)
