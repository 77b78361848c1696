"""Fewer samples of a signal, with a bound on the error of the straight lines between them.

The method is Ramer's and Douglas and Peucker's with the vertical distance: of every stretch that a straight line does not follow within the
tolerance, the farthest sample is kept, and both parts are looked at again. All stretches of one depth are treated together.

U. Ramer, An iterative procedure for the polygonal approximation of plane curves, Comput. Graph. Image Process. 1 (1972) 244;
D. Douglas, T. Peucker, Algorithms for the reduction of the number of points, Cartographica 10 (1973) 112.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from powertrain.language.reals import Array

Places = NDArray[np.intp]


def kept_samples(t: Array, y: Array, tolerance: float) -> Places:
    """The places of samples between which straight lines follow all samples within ``tolerance`` (in the unit of ``y``).

    ``t`` does not decrease. A jump, two samples at one time, is kept whole where it exceeds the tolerance. A signal that is not
    finite everywhere, such as a ratio at rest, keeps all its samples.
    """
    if len(t) < 3 or not np.isfinite(y).all():
        return np.arange(len(t))
    kept = np.zeros(len(t), bool)
    kept[[0, -1]] = True
    first, last = np.array([0]), np.array([len(t) - 1])
    while first.size:
        worst, farthest = _farthest(t, y, first, last)
        bad = worst > tolerance
        middle = farthest[bad]
        kept[middle] = True
        first, last = np.concatenate([first[bad], middle]), np.concatenate([middle, last[bad]])
        open_ = last - first > 1
        first, last = first[open_], last[open_]
    return np.flatnonzero(kept)


def _farthest(t: Array, y: Array, first: Places, last: Places) -> tuple[Array, Places]:
    """For every stretch, the largest vertical distance of its inner samples from the line between its ends, and the sample."""
    length = last - first
    begin = np.cumsum(length) - length
    stretch = np.repeat(np.arange(first.size), length)
    sample = np.arange(length.sum()) - begin[stretch] + first[stretch]
    a, b = first[stretch], last[stretch]
    duration = t[b] - t[a]
    share = np.divide(t[sample] - t[a], duration, out=np.zeros(len(sample)), where=duration > 0)
    distance = np.abs(y[sample] - y[a] - share * (y[b] - y[a]))
    worst = np.maximum.reduceat(distance, begin)
    reached = np.flatnonzero(distance == worst[stretch])
    _, once = np.unique(stretch[reached], return_index=True)
    return worst, sample[reached[once]]
