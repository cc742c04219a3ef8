"""Hamel's top as one writes it who leaves MuJoCo's options and contacts as they are."""

import mujoco

import magmotor as mm


def plain_top(scene: mm.Top, option: str = "", geom: str = "") -> mujoco.MjModel:
    """A free ball on a floor, under dipoles; `option` and `geom` are MJCF attributes of both."""
    ring = "".join(
        f'<site pos="{_text(place)}" zaxis="{_text(moment)}" user="{scene.moment}"/>'
        for place, moment in zip(*scene.ring_sources(), strict=True)
    )
    return mujoco.MjModel.from_xml_string(f"""
<mujoco>
  <option {option}/>
  <default>
    <geom {geom}/>
  </default>
  <worldbody>
    <geom type="plane" size="1 1 0.1"/>
    {ring}
    <body name="ball" pos="{_text([*scene.position, scene.ball_radius])}">
      <freejoint/>
      <geom type="sphere" size="{scene.ball_radius}" mass="{scene.ball_mass}"/>
      <site zaxis="{_text(scene.axis)}" user="{scene.moment}"/>
    </body>
  </worldbody>
</mujoco>
""")


def _text(vector) -> str:
    return " ".join(f"{number:.17g}" for number in vector)
