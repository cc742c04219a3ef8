"""Write a scene as one standalone MJCF file, which any MuJoCo viewer opens."""

import re
from pathlib import Path
from typing import Annotated

import tyro
