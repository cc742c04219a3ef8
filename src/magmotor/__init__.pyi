from . import dataset as dataset
from . import dipoles as dipoles
from . import noise as noise
from . import observables as observables
from . import plots as plots
from . import render as render
from . import theory as theory
from .dataset import scene_of as scene_of
from .engines.mujoco.baoab import Baoab as Baoab
from .engines.mujoco.build import build as build
from .engines.mujoco.layout import LayoutError as LayoutError
from .engines.mujoco.magnetism import magnetism as magnetism
from .ensemble import ensemble as ensemble
from .ensemble import gibbs as gibbs
from .recommendation import Recommendation as Recommendation
from .recommendation import recommend as recommend
from .scenes import Disk as Disk
from .scenes import LangevinParticle as LangevinParticle
from .scenes import Motor as Motor
from .scenes import Top as Top
from .scenes import Waypoint as Waypoint
from .simulation import SimulationDiverged as SimulationDiverged
from .simulation import SimulationInterrupted as SimulationInterrupted
from .simulation import methods as methods
from .simulation import simulate as simulate

__version__: str
