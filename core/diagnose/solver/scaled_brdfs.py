"""The BRDFs of a fitted model, each with the factor of its reflectance."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ...basis import PrincipalBRDF
from ..forward.material_brdfs import MaterialBRDFs
from ..nuisances.material_scale import MaterialScale
from .model import Model


def scaled_brdfs(model: Model) -> MaterialBRDFs:
    """The BRDFs of a model with the factors of MaterialScale, for use without that."""
    if MaterialScale.cause not in model.causes:
        return model.brdfs
    factor = np.ones(len(model.brdfs.coefficients))
    found = np.exp(model.parameters_of(MaterialScale.cause))
    factor[: len(found)] = found
    return replace(model.brdfs, scale=factor)


def with_scaled_brdfs(model: Model) -> Model:
    """The same model, with the factors of MaterialScale in its BRDFs instead of in an effect."""
    if MaterialScale.cause not in model.causes:
        return model
    return replace(model.without_effect(MaterialScale.cause), brdfs=scaled_brdfs(model))


def with_brdf(model: Model, material: int, brdf: PrincipalBRDF) -> Model:
    """The same model with another BRDF of one material, in the basis of the model's BRDFs. brdf: in
    1/sr in the unit of the model's irradiance."""
    found = with_scaled_brdfs(model)
    coefficients = found.brdfs.coefficients.copy()
    coefficients[material] = 0.0
    coefficients[material, :, : brdf.coefficients.shape[1]] = brdf.coefficients
    scale = found.brdfs.scale
    if scale is not None:
        scale = scale.copy()
        scale[material] = 1.0
    return replace(found, brdfs=replace(found.brdfs, coefficients=coefficients, scale=scale))
