"""All effects, one in each file, by their cause names."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from functools import partial

from ...concurrency.ordered_map import ordered_map
from ..forward.diagnosis_context import DiagnosisContext
from .ambient_light import AmbientLight
from .anisotropy import Anisotropy
from .area_light import AreaLight
from .base.effect import Effect
from .black_level import BlackLevel
from .camera_pose import CameraPose
from .camera_response import CameraResponse
from .cast_shadow import CastShadow
from .clipping import Clipping
from .environment_reflection import EnvironmentReflection
from .flash_offset import FlashOffset
from .interreflection import Interreflection
from .lamp_position import LampPosition
from .light_direction import LightDirection
from .light_intensity import LightIntensity
from .near_light import NearLight
from .normal_error import NormalError
from .outside_basis import OutsideBasis
from .second_material import SecondMaterial
from .subsurface import Subsurface
from .veiling_glare import VeilingGlare
from .vignetting import Vignetting

EFFECTS: tuple[type[Effect], ...] = (
    LightDirection,
    LightIntensity,
    NearLight,
    LampPosition,
    FlashOffset,
    AreaLight,
    AmbientLight,
    CameraResponse,
    BlackLevel,
    Clipping,
    Vignetting,
    VeilingGlare,
    CameraPose,
    Interreflection,
    EnvironmentReflection,
    Anisotropy,
    NormalError,
    SecondMaterial,
    Subsurface,
    CastShadow,
    OutsideBasis,
)


def effects_for(context: DiagnosisContext, pool: ThreadPoolExecutor | None = None) -> list[Effect]:
    """All effects that can occur in the capture. pool: threads that build several at once."""
    shared = ("surroundings", "visible_faces")  # computed once, before several effects read them
    list(ordered_map(pool, partial(getattr, context), shared, ahead=len(shared)))
    made = ordered_map(pool, lambda kind: kind.of(context), EFFECTS, ahead=len(EFFECTS))
    return [effect for effect in made if effect is not None]
