"""Public names and the modules that they come from; `finger3d` reads this table when it is imported."""

from finger3d.analyses.calibrate.run import calibrate as calibrate
from finger3d.analyses.compare import compare as compare
from finger3d.analyses.cost import cost as cost
from finger3d.analyses.cost import plan as plan
from finger3d.analyses.gauge_places import place_gauges as place_gauges
from finger3d.analyses.identify.run import identify as identify
from finger3d.analyses.optimise import optimise as optimise
from finger3d.analyses.press import press as press
from finger3d.analyses.reduced import ReducedModel as ReducedModel
from finger3d.analyses.result import PressResult as PressResult
from finger3d.analyses.result import load as load
from finger3d.analyses.sensitivity import sensitivity as sensitivity
from finger3d.analyses.sweep.run import sweep as sweep
from finger3d.contact.friction import Coulomb as Coulomb
from finger3d.errors import Finger3dError as Finger3dError
from finger3d.errors import MissingError as MissingError
from finger3d.errors import Outcome as Outcome
from finger3d.fem.laws.material import Isotropic as Isotropic
from finger3d.fem.mesh import Mesh as Mesh
from finger3d.geometry.design import designs as designs
from finger3d.mechanics.model import Leg as Leg
from finger3d.mechanics.model import MeshOptions as MeshOptions
from finger3d.mechanics.model import Model as Model
from finger3d.mechanics.readings import Gauge as Gauge
from finger3d.mold.export import export as export
from finger3d.mold.options import MoldOptions as MoldOptions
from finger3d.objects import Cylinder as Cylinder
from finger3d.objects import Plane as Plane
from finger3d.objects import Sphere as Sphere
from finger3d.objects import Wave as Wave
from finger3d.objects import Wedge as Wedge
from finger3d.scene import Scene as Scene
from finger3d.scene import parse as parse
from finger3d.sensor import estimate as estimate

__version__: str
