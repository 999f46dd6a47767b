"""The shapes on either side of a silhouette."""

from __future__ import annotations

from jaxtyping import Array, Bool, Float, Int

from firstorder._display import Module
from firstorder.numerics._select import either
from firstorder.numerics._vectors import rows


class SilhouetteSides(Module):
    """The shapes on either side of silhouette pieces.

    Attributes:
        owner: number of the shape to the left, whose silhouette it is.
        seen: whether the owner is seen there.
        behind: number of the shape to the right, -1 for the sky.
        cut: whether that one goes on behind the owner, so that this piece is where it ends.
    """

    owner: Int[Array, "*m"]
    seen: Bool[Array, "*m"]
    behind: Int[Array, "*m"]
    cut: Bool[Array, "*m"]

    def jump(self, shown: Float[Array, " n_1"]) -> Float[Array, "*m"]:
        """Jump across each piece, owner less what it cuts off; zero for a piece that is hidden.

        Args:
            shown: one number for each shape, and last the sky's.
        """
        right = either(self.cut, shown[self.behind], 0.0)
        return either(self.seen, rows(shown, self.owner) - right, 0.0)
