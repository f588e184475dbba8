"""Ray casting with Embree: needs no system library. Slower, the same picture."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from elocute.array_types import Float32Array, FloatArray
from elocute.head.model import HeadModel
from elocute.numerics.image_sampling import bilinear
from elocute.render import shading
from elocute.render.camera import Camera, shadow_view
from elocute.render.parts import Part, Parts
from elocute.render.stage import Stage

# Where edges need it, a pixel is the mean of four more rays (a rotated grid).
GRID = ((0.125, 0.375), (0.375, -0.125), (-0.125, -0.375), (-0.375, 0.125))
EDGE = 0.05  # difference of neighbouring pixels (0…1) that counts as an edge
LAYERS = 12  # sheets of hair that a ray may pass
STEP_M = 1e-5  # past a sheet
BLOCK = 1 << 14  # points that are lit at a time: their arrays stay in the cache


class RayRenderer:
    """One head, one camera."""

    def __init__(
        self, head: HeadModel, size: tuple[int, int], camera: Camera, stage: Stage
    ) -> None:
        import embreex  # noqa: F401  said here, not at the first frame

        # A draft has fewer rays than pixels.
        share = min(1.0, stage.profile.oversampling)
        self._shown, self._size = size, (round(size[0] * share), round(size[1] * share))
        self._stage = stage
        self._parts = Parts(head, stage.profile.image_side)
        self._exposure = self._parts.exposure(stage.rig)
        self._triangles = np.concatenate([part.triangles for part in self._parts.parts])
        counts = [len(part.triangles) for part in self._parts.parts]
        self._part_of = np.repeat(np.arange(len(counts), dtype=np.int16), counts)
        self._both_sides = np.array([p.surface.both_sides for p in self._parts.parts])
        self._key = shadow_view(head, stage.rig)
        self._eye = camera.position.astype(np.float32)
        self._axes = camera.axes()
        self._reach = float(np.tan(np.radians(camera.field_deg) / 2))
        self._behind = self._ground()

    def _ground(self) -> Float32Array:
        """(pixel, 3) sRGB of what lies behind the head."""
        width, height = self._shown
        if self._stage.backdrop is not None:
            backdrop = self._stage.backdrop_for(self._shown).reshape(-1, 3)
            return backdrop.astype(np.float32) / np.float32(255)
        rows, columns = np.mgrid[:height, :width].astype(np.float32) + np.float32(0.5)
        at = np.stack([columns.ravel() / width, 1 - rows.ravel() / height], axis=1)
        return shading.ground(at.astype(np.float32), self._stage.rig)

    def frame(self, points: NDArray[np.float32]) -> NDArray[np.uint8]:
        """(height, width, 3 or 4) picture of vertices (vertex, 3) m."""
        scene = _Scene(self._parts, self._triangles, self._part_of, points, self._both_sides)
        moments = self._moments(scene)
        width, height = self._size
        pixels = self._cast(scene, moments, np.arange(width * height), np.zeros(2))
        edges = self._edges(pixels.reshape(height, width, 4))
        if len(edges):
            offsets = np.repeat(GRID, len(edges), axis=0)  # all at once: small pictures take long
            more = self._cast(scene, moments, np.tile(edges, len(GRID)), offsets)
            pixels[edges] = more.reshape(len(GRID), len(edges), 4).mean(axis=0)
        return self._finished(self._enlarged(pixels))

    def _enlarged(self, pixels: Float32Array) -> Float32Array:
        """(pixel, 4) of a picture as large as it is shown."""
        if self._shown == self._size:
            return pixels
        width, height = self._shown
        rows, columns = np.mgrid[:height, :width].astype(np.float32) + np.float32(0.5)
        at = np.stack([columns.ravel() / width, rows.ravel() / height], axis=1)
        return bilinear(pixels.reshape(self._size[1], self._size[0], 4), at, repeat=False)

    def frames(self, faces: Iterable[NDArray[np.float32]]) -> Iterator[NDArray[np.uint8]]:
        """One `frame` for each."""
        return map(self.frame, faces)

    def _finished(self, pixels: Float32Array) -> NDArray[np.uint8]:
        """The ground laid behind, in bytes."""
        width, height = self._shown
        color, alpha = pixels[:, :3], pixels[:, 3:]
        if self._stage.transparent:
            straight = np.concatenate([color / np.maximum(alpha, 1e-6), alpha], axis=1)
            whole = np.clip(straight * 255 + 0.5, 0, 255).astype(np.uint8)
            return whole.reshape(height, width, 4)
        rows, columns = np.mgrid[:height, :width].astype(np.float32)
        place = (columns + 0.5) * 0.06711056 + (height - rows - 0.5) * 0.00583715
        noise = (52.9829189 * (place % 1)) % 1
        whole = (color + (1 - alpha) * self._behind) * 255 + noise.reshape(-1, 1)
        return np.clip(whole, 0, 255).astype(np.uint8).reshape(height, width, 3)

    def _moments(self, scene: _Scene) -> Float32Array:
        """(side, side, 2) blurred depth and squared depth as the key sees them."""
        side = 2 * self._stage.profile.shadow_side
        line = (np.arange(side, dtype=np.float32) + 0.5) / side * 2 - 1
        y, x = np.meshgrid(line, line, indexing="ij")
        back = np.linalg.inv(self._key.matrix.astype(np.float64))
        near = np.stack([x.ravel(), y.ravel(), np.full(side * side, -1), np.ones(side * side)], 1)
        origins = (near @ back.T)[:, :3].astype(np.float32)
        towards = (back[:3, 2] / np.linalg.norm(back[:3, 2])).astype(np.float32)
        directions = np.repeat(towards[None], len(origins), axis=0)
        depths = np.ones(side * side, np.float32)
        for hits in scene.layers(origins, directions, for_shadow=True):
            depths[hits.rays[hits.solid]] = hits.distance[hits.solid] / self._key.radius - 1
        raw = np.stack([depths, depths * depths], axis=1).reshape(side, side, 2)
        return self._blurred(raw)

    def _blurred(self, raw: Float32Array) -> Float32Array:
        side = self._stage.profile.shadow_side
        line = (np.arange(side, dtype=np.float32) + 0.5) / side
        y, x = np.meshgrid(line, line, indexing="ij")
        at = np.stack([x.ravel(), y.ravel()], axis=1)
        image = raw
        for axis in (0, 1):
            total = np.zeros((side * side, 2), np.float32)
            for offset, weight in self._key.taps(side):
                shifted = at.copy()
                shifted[:, axis] += np.float32(offset / side)
                total += bilinear(image, shifted, repeat=False) * np.float32(weight)
            image = total.reshape(side, side, 2)
        return image

    def _cast(
        self,
        scene: _Scene,
        moments: Float32Array,
        pixels: NDArray[np.intp],
        offsets: FloatArray,
    ) -> Float32Array:
        """(ray, 4) premultiplied sRGB of rays through pixels (ray,), moved by parts of a pixel."""
        rays = self._rays(pixels, offsets)
        eyes = np.repeat(self._eye[None], len(rays), axis=0)
        colors = np.zeros((len(pixels), 4), np.float32)
        for hits in scene.layers(eyes, rays):
            for number in np.unique(hits.part):
                chosen = np.flatnonzero((hits.part == number) & (hits.alpha > 0))
                for start in range(0, len(chosen), BLOCK):
                    block = chosen[start : start + BLOCK]
                    lit = self._lit(scene, moments, hits, block, -rays[hits.rays[block]])
                    alpha = hits.alpha[block, None]
                    under = np.concatenate([lit * alpha, alpha], axis=1)
                    places = hits.rays[block]
                    colors[places] += (1 - colors[places, 3:]) * under
        return colors

    def _rays(self, pixels: NDArray[np.intp], offsets: FloatArray) -> Float32Array:
        width, height = self._size
        x = (pixels % width + 0.5 + offsets[..., 0]) / width * 2 - 1
        y = 1 - (pixels // width + 0.5 + offsets[..., 1]) / height * 2
        local = np.stack(
            [x * self._reach * width / height, y * self._reach, -np.ones(len(pixels))], axis=1
        )
        rays = (local @ self._axes).astype(np.float32)
        return rays / np.linalg.norm(rays, axis=1, keepdims=True)

    def _lit(
        self,
        scene: _Scene,
        moments: Float32Array,
        hits: _Hits,
        chosen: NDArray[np.intp],
        views: Float32Array,
    ) -> Float32Array:
        """sRGB (hit, 3) of hits on one part."""
        part = self._parts.parts[hits.part[chosen[0]]]
        surface = part.surface
        corners = self._triangles[hits.face[chosen]]
        shares = hits.shares[chosen]
        place = scene.between(corners, shares, slice(0, 3))
        blunt = scene.between(corners, shares, slice(3, 6))
        blunt /= np.maximum(np.linalg.norm(blunt, axis=1, keepdims=True), 1e-9)
        if part.turns:
            blunt *= hits.front[chosen, None]
        at = hits.at[chosen]
        # As sampling of mip maps does: the level at which a texel is about a pixel.
        distance = hits.distance[chosen]
        slant = np.maximum(np.abs((blunt * views).sum(axis=1)), 0.15)
        pixel_m = 2 * self._reach * distance / self._size[1] / slant
        density = scene.density[hits.face[chosen]] * pixel_m

        albedo = _weighted(self._parts.color, corners, shares) * np.array(surface.tint, np.float32)
        if part.color is not None:
            spot = at
            if surface.iris_depth > 0:
                eye = surface.eye_rad, surface.iris_rad, surface.iris_depth
                ways = shading.tangents(*scene.frames(corners), blunt)
                spot = shading.refracted(at, eye, views, *ways, blunt)
            albedo = albedo * part.color.at_density(spot, density)[:, :3]
        occlusion = _weighted(self._parts.occlusion[:, None], corners, shares)
        roughness = np.full((len(chosen), 1), part.rough, np.float32)
        metal: Float32Array | float = 0.0
        if surface.metal:
            metal = np.full((len(chosen), 1), surface.metal, np.float32)
        if part.roughness is not None:
            rough = part.roughness.at_density(at, density)
            occlusion = np.minimum(occlusion, rough[:, :1])
            roughness, metal = roughness * rough[:, 1:2], metal * rough[:, 2:3]
        strand = np.zeros_like(blunt)
        if part.finish.strand:
            strand = _weighted(self._parts.strand, corners, shares)
            strand /= np.maximum(np.linalg.norm(strand, axis=1, keepdims=True), 1e-9)
        from_key = place @ self._key.matrix[:3, :3].T + self._key.matrix[:3, 3]
        seen = bilinear(moments, from_key[:, :2] * 0.5 + 0.5, repeat=False)
        point = shading.Point(
            albedo=albedo,
            normal=blunt,
            blunt=blunt,
            view=views,
            strand=strand,
            occlusion=occlusion,
            roughness=np.clip(roughness, 0.05, 1),
            shadow=shading.open_to_key(seen, from_key[:, 2:] - shading.SHADOW_BIAS),
            metal=metal if surface.metal else 0.0,
        )
        if part.inside:
            point = shading.enclosed(point, _weighted(scene.openness, corners, shares))
        point = self._turned(scene, part, point, corners, shares, at, density)
        if surface.shade is not None:
            return shading.painted(point, surface.shade, self._stage.rig)
        return shading.shown(shading.lit(point, part.finish, self._stage.rig), self._exposure)

    @staticmethod
    def _turned(
        scene: _Scene,
        part: Part,
        point: shading.Point,
        corners: NDArray[np.int32],
        shares: Float32Array,
        at: Float32Array,
        density: Float32Array,
    ) -> shading.Point:
        """Points with the normals of their relief and their folds."""
        if part.normal is None and part.folds is None:
            return point
        texel = np.tile(np.array([0.5, 0.5, 1.0], np.float32), (len(at), 1))
        if part.normal is not None:
            texel = part.normal.at_density(at, density)[:, :3]
        if part.folds is not None:
            strong = _weighted(scene.folded, corners, shares)
            heights = part.fold_heights(strong, at, density)
            point, texel = shading.folded(point, texel, heights)
        ways = shading.tangents(*scene.frames(corners), point.blunt)
        normal = shading.bumped(texel, part.surface.normal_scale, *ways, point.blunt)
        return replace(point, normal=normal)

    @staticmethod
    def _edges(picture: Float32Array) -> NDArray[np.intp]:
        """Flat indices of pixels that differ from a neighbour."""
        across = np.abs(np.diff(picture, axis=1)).max(axis=2) > EDGE
        down = np.abs(np.diff(picture, axis=0)).max(axis=2) > EDGE
        edge = np.zeros(picture.shape[:2], bool)
        edge[:, 1:] |= across
        edge[:, :-1] |= across
        edge[1:] |= down
        edge[:-1] |= down
        return np.flatnonzero(edge)

    def __enter__(self) -> RayRenderer:
        return self

    def __exit__(self, *_: object) -> None:
        pass


class _Hits:
    """What rays meet first, or next."""

    def __init__(self, rays: NDArray[np.intp], hits: dict[str, Any], scene: _Scene) -> None:
        self.rays = rays
        """(hit,) which of the rays."""
        self.face: NDArray[np.intp] = hits["face"]
        self.distance: Float32Array = hits["distance"]
        """(hit,) from the ray's own beginning, m."""
        u, v = hits["u"], hits["v"]
        self.shares: Float32Array = np.stack([1 - u - v, u, v], axis=1).astype(np.float32)
        self.front: Float32Array = hits["front"]
        """(hit,) 1 on a face's own side, -1 on its far side."""
        self.part = scene.part_of[self.face]
        corners = scene.triangles[self.face]
        self.at: Float32Array = _weighted(scene.parts.at, corners, self.shares)
        self.alpha: Float32Array = np.ones(len(rays), np.float32)
        self.solid = np.ones(len(rays), bool)


class _Scene:
    """The head of one frame, as rays meet it."""

    def __init__(
        self,
        parts: Parts,
        triangles: NDArray[np.int32],
        part_of: NDArray[np.int16],
        points: Float32Array,
        both_sides: NDArray[np.bool_],
    ) -> None:
        from embreex.mesh_construction import TriangleMesh
        from embreex.rtcore_scene import EmbreeScene

        self.parts, self.triangles, self.part_of = parts, triangles, part_of
        self._both_sides = both_sides
        self._moved = parts.moved(points)
        if parts.fold_masks is not None:
            self.folded = parts.folded(points)
            """(split, set) how strong folds are."""
        self.openness: Float32Array = parts.openness(points)
        """(split, 1) how open to the room what is in the mouth is."""
        self._scene = EmbreeScene()
        corners = np.ascontiguousarray(self._moved[triangles, :3], np.float32)
        TriangleMesh(self._scene, corners)
        first, second = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
        self._normals = np.cross(first, second)
        at = parts.at[triangles]
        one, two = at[:, 1] - at[:, 0], at[:, 2] - at[:, 0]
        drawn = np.abs(one[:, 0] * two[:, 1] - one[:, 1] * two[:, 0])
        self._areas = np.maximum(np.linalg.norm(self._normals, axis=1), 1e-16)
        self.density: Float32Array = np.sqrt(drawn / self._areas)
        """(triangle,) texture coordinates per metre."""

    def between(self, corners: Any, shares: Float32Array, columns: slice) -> Float32Array:
        """Places or normals (hit, 3) between the corners of triangles."""
        return _weighted(self._moved[:, columns], corners, shares)

    def frames(
        self, corners: NDArray[np.int32]
    ) -> tuple[Float32Array, Float32Array, Float32Array, Float32Array]:
        """Edges (hit, 3) of triangles, two each, and their change of texture coordinates."""
        place, at = self._moved[corners, :3], self.parts.at[corners]
        return (
            place[:, 1] - place[:, 0],
            place[:, 2] - place[:, 0],
            at[:, 1] - at[:, 0],
            at[:, 2] - at[:, 0],
        )

    def layers(
        self, origins: Float32Array, rays: Float32Array, *, for_shadow: bool = False
    ) -> Iterator[_Hits]:
        """What rays meet, from the first sheet to what is solid."""
        going = np.arange(len(rays))
        gone = np.zeros(len(rays), np.float32)
        for _ in range(LAYERS):
            starts = origins[going] + rays[going] * gone[going, None]
            hit = self._scene.run(starts, rays[going], output=True)
            struck = np.flatnonzero(hit["primID"] >= 0)
            if not len(struck):
                return
            which, face = going[struck], hit["primID"][struck]
            distance = gone[which] + hit["tfar"][struck]
            slant = (self._normals[face] * rays[which]).sum(axis=1) / self._areas[face]
            front = np.where(slant <= 0, 1, -1)
            hits = _Hits(
                which,
                {
                    "face": face,
                    "distance": distance,
                    "u": hit["u"][struck],
                    "v": hit["v"][struck],
                    "front": front.astype(np.float32),
                },
                self,
            )
            self._find_alpha(hits, None if for_shadow else slant)
            yield hits
            going = which[~hits.solid]
            if not len(going):
                return
            gone[going] = distance[~hits.solid] + np.float32(STEP_M)

    def _find_alpha(self, hits: _Hits, slant: Float32Array | None) -> None:
        """Which hits are solid, and how much the others cover; for shadows without a slant."""
        for_shadow = slant is None
        for number in np.unique(hits.part):
            part: Part = self.parts.parts[number]
            chosen = np.flatnonzero(hits.part == number)
            if for_shadow and not part.casts:
                hits.solid[chosen], hits.alpha[chosen] = False, 0
                continue
            if not self._both_sides[number] and not for_shadow:
                away = chosen[hits.front[chosen] < 0]
                hits.solid[away], hits.alpha[away] = False, 0
                chosen = chosen[hits.front[chosen] > 0]
            if part.solid or part.color is None:
                continue
            alpha = part.color.texels(hits.at[chosen])[:, 3] * np.float32(part.surface.alpha)
            if slant is not None and part.fades:
                alpha = alpha * shading.edge_on(slant[chosen])
            core = alpha >= (0.5 if for_shadow else part.core)
            fringe = np.where(alpha >= 0.01, alpha, 0) * part.surface.fringed * part.fringe_gain
            hits.solid[chosen] = core
            hits.alpha[chosen] = np.where(core, 1, np.minimum(fringe, 1))


def _weighted(values: Float32Array, corners: Any, shares: Float32Array) -> Float32Array:
    """(hit, channel) between the three corners of each triangle."""
    a, b, c = (values[corners[:, k]] * shares[:, k, None] for k in range(3))
    return np.asarray(a + b + c, np.float32)
