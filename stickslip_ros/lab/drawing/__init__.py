"""The stand as one sees it: where its parts are, as a drawing, as a film and as a URDF."""
