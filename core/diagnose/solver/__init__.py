"""The joint fit of BRDFs and effects: model, Jacobian, block elimination, Gauss-Newton."""
