"""Materials that vary over the surface: reflectance and normals at each node of a fine grid on the
mesh, estimated from all photos with a hierarchical prior."""
