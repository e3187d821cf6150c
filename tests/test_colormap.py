"""The colours of pressure: which map, in even steps of lightness, and which pressure has which."""

import numpy as np
from matplotlib import colormaps

from warp_mpm.output import colormap


def lightness(linear):
    """CIELAB lightness L*, 0 to 100, of linear RGB (n, 3): luminance by IEC 61966-2-1, L* by CIE 15:2004."""
    luminance = linear @ [0.2126, 0.7152, 0.0722]
    return np.where(luminance > (6 / 29) ** 3, 116 * np.cbrt(luminance) - 16, (29 / 3) ** 3 * luminance)


def test_higher_pressure_is_lighter_in_even_steps():
    shades = lightness(colormap.linear_table().astype(float))
    assert shades[0] < 1
    assert shades[-1] > 95
    assert (np.diff(shades) > 0).all()
    steps = np.diff(shades[::15])  # wide enough for the rounding to 8 bits not to matter
    np.testing.assert_allclose(steps, steps.mean(), rtol=0.5)  # a rainbow has steps down among them


def test_color_table_is_inferno():
    np.testing.assert_allclose(colormap.srgb_table(), colormaps["inferno"].colors, atol=0.5 / 255)
    np.testing.assert_allclose(
        colormap.linear_table()[[0, 255]], [[0, 0, 4 / 255 / 12.92], [0.9734, 1, 0.3712]], atol=1e-4
    )


def test_color_indices():
    pressure = np.array([-1.0, 0.0, 1.0, 1.9, 2.1, 255.9, 256.0, 1e30, np.inf, -np.inf, np.nan], dtype=np.float32)
    expected = [0, 0, 1, 1, 2, 255, 255, 255, 255, 0, 0]
    indices = colormap.indices(pressure, 0.0, 256.0)
    assert indices.dtype == np.int32
    np.testing.assert_array_equal(indices, expected)
