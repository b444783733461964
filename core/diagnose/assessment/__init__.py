"""How far the joint fit of a diagnosis can be trusted: parameters, calibration, residuals."""
