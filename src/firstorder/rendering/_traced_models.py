"""The meshes of a world as the renderer meets them: one tree of Embree over the faces of all."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Bool, Float, Int

from firstorder.imaging._light_terms import Light
from firstorder.imaging.facets import mesh_facets
from firstorder.io.meshes import Embree
from firstorder.io.scenes.space_toml import MeshModel
from firstorder.rendering._pixel_radiance import OFF, before_lamp
from firstorder.rendering._shadow_edges import beside_seen
from firstorder.space.meshes.triangle_mesh import mesh


class TracedModels:
    """Models of a world: their faces for shading, and a tracer of all of them.

    Args:
        models: meshes with materials.
        normals: of each model, at its vertices; None for `vertex_normals`.
        first: number of the first model among the primitives of the world.

    Attributes:
        facets: faces of all models, as shading takes them.
        embree: the tracer, which counts faces alike.

    Raises:
        ModuleNotFoundError: without the extra `mesh`.
    """

    def __init__(self, models: Sequence[MeshModel], normals: Sequence[Any] | None, first: int):
        parts, vertices, faces, known = [], [], [], 0
        each = normals or (None,) * len(models)
        for number, (model, n) in enumerate(zip(models, each, strict=True), first):
            numbers = np.full(model.mesh.count, number)
            parts.append(mesh_facets(model.mesh, n, numbers, model.uv))
            vertices.append(np.asarray(model.mesh.vertices))
            faces.append(np.asarray(model.mesh.faces) + known)
            known += len(vertices[-1])
        self.facets = jax.tree.map(lambda *a: jnp.concatenate(a), *parts)
        whole = mesh(np.concatenate(vertices), np.concatenate(faces))
        self.embree, self._size = Embree(whole), whole.size
        ends = np.asarray(whole.vertices)
        self._middle = 0.5 * (ends.min(0) + ends.max(0))
        self._number = np.asarray(self.facets.part)
        up = np.array(whole.area_vectors)
        size = np.linalg.norm(up, axis=1, keepdims=True)
        self._up = up / np.where(size > 0.0, size, 1.0)

    def seen_from(self, eye: Float[np.ndarray, "3"], d: Float[np.ndarray, "n 3"]):
        """Distances of the faces that rays from an eye meet, their numbers, and their models'."""
        t, face = self.embree.seen_from(eye, d)
        return t, face, self._number[face]

    def normals_against(
        self, face: Int[np.ndarray, " n"], d: Float[np.ndarray, "n 3"]
    ) -> Float[np.ndarray, "n 3"]:
        """Unit normals of faces, on the sides that rays along d meet."""
        up = self._up[face]
        return np.where(np.einsum("ij,ij->i", up, d)[:, None] > 0.0, -up, up)

    def hidden(
        self,
        x: Float[np.ndarray, "n 3"],
        up: Float[np.ndarray, "n 3"],
        way: Float[np.ndarray, "n k 3"],
        lit: Bool[np.ndarray, "n k"],
        share: Float[np.ndarray, "n k"],
        light: Light,
        depths: bool,
    ) -> Float[np.ndarray, "n k"]:
        """Shares of the ways from a block of points at which a light's nodes are hidden.

        Visibility is traced in single precision. The distance of a blocker only counts beside its
        edge, and is traced for two nodes there, in double; elsewhere it is anywhere on the way.

        Args:
            x: the points [m].
            up: their base normals.
            way: to each node [m].
            lit: whether the node is above the surface and sends light to it.
            share: at which analytic shapes hide it, infinity where none does; it is overwritten.
            light: whose nodes they are.
            depths: whether distances are wanted; if not, what hides is somewhere on the way.
        """
        row, node = np.nonzero(lit)
        start, along = x[row] + OFF * self._size * up[row], way[row, node]
        far = np.sqrt(np.sum(along**2, -1))
        if light.near:
            along = along + x[row] + before_lamp(light, OFF * self._size)[node] - start
        else:
            beyond = np.linalg.norm(x - self._middle, axis=1) + self._size
            along = along * (beyond[row] / far)[:, None]
        met = self.embree.between(start, start + along)
        row, node, start, along, far = row[met], node[met], start[met], along[met], far[met]
        at = np.full(len(far), 0.5)  # somewhere on the way
        if depths:
            whole = share < (1.0 if light.near else np.inf)  # what is behind a lamp hides nothing
            whole[row, node] = True
            edge = beside_seen(whole.reshape(-1, *light.shape), light.wraps)
            edge = edge.reshape(whole.shape)[row, node]
            way_to = self.embree.nearest(start[edge], along[edge]).t
            way_to = way_to * np.sqrt(np.sum(along[edge] ** 2, -1)) / far[edge]
            # What single precision alone meets has no depth, and its edge does not move.
            at[edge] = np.where(np.isfinite(way_to), way_to, 0.0)
        share[row, node] = np.minimum(share[row, node], at)
        return share
