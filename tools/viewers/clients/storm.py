"""Draws a frame of a USD file with Storm, the renderer of usdview, with the settings of usdview and usdrecord.

    python storm.py FILE --frame 3 --size 400 --picture storm.png

The light at the camera is one of these settings, so a surface must not reflect it for its colours to be true.
"""

import argparse
import json

import bpy
import opengl


def main() -> None:
    """Draw what the command line says, and print a JSON object."""
    parser = argparse.ArgumentParser()
    parser.add_argument("file")
    parser.add_argument("--frame", type=int, required=True)
    parser.add_argument("--size", type=int, default=400, help="width of the picture [pixels]")
    parser.add_argument("--picture", required=True)
    options = parser.parse_args()
    opengl.make_current()
    bpy.utils.expose_bundled_modules()
    from pxr import Usd, UsdAppUtils, UsdGeom

    stage = Usd.Stage.Open(options.file)
    recorder = UsdAppUtils.FrameRecorder("HdStormRendererPlugin")
    recorder.SetImageWidth(options.size)
    recorder.SetColorCorrectionMode("sRGB")
    camera = UsdGeom.Camera(stage.GetPrimAtPath("/World/camera"))
    recorder.Record(stage, camera, float(options.frame), options.picture)
    report = {
        "client": "Storm",
        "version": "of USD {1}.{2:02d}".format(*Usd.GetVersion()),
        "opengl": opengl.name(),
    }
    print(json.dumps(report))


if __name__ == "__main__":
    main()
