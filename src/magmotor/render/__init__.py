"""Movies and pictures of recorded runs."""

from magmotor.render.contact_sheet import contact_sheet
from magmotor.render.movie import movie, still
from magmotor.render.views import NoOpenGL

__all__ = ["NoOpenGL", "contact_sheet", "movie", "still"]
