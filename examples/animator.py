"""A recording becomes a scene file and a video.

python examples/animator.py speech.wav out/
"""

import argparse
from pathlib import Path

import elocute

CLIP = Path(elocute.__file__).parent / "assets" / "example.flac"


def main() -> None:
    parser = argparse.ArgumentParser(description="Animate a recording.")
    parser.add_argument("speech", nargs="?", default=CLIP, type=Path)
    parser.add_argument("output", nargs="?", default="out", type=Path)
    parser.add_argument("--size", default=800, type=int, help="of the video, pixels")
    given = parser.parse_args()
    given.output.mkdir(parents=True, exist_ok=True)

    # A broad speaker with Hana's face, and a calmer take of the same words to choose from.
    for style, strength in (("broad", 1.0), ("calm", 0.9)):
        take = elocute.animate(
            given.speech, fps=30, identity="hana", style=style, strength=strength
        )
        opening = elocute.measure_mouth(take.motion)["opening_mm"]
        print(f"{style}: the mouth opens {opening.mean():.1f} mm on average")
        take.write(given.output / f"{style}.glb", embed_audio=True)
        take.write(given.output / f"{style}.mp4", size=(given.size, given.size))


if __name__ == "__main__":
    main()
