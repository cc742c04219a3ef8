"""Movies and pictures of recorded runs."""

from magmotor.render.camera import NoOpenGL
from magmotor.render.contact_sheet import contact_sheet
from magmotor.render.movie import movie, still

__all__ = ["NoOpenGL", "contact_sheet", "movie", "still"]
