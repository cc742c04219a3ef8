"""A tree of boxes around points: each box is halved along its longest side, down to eight points.

Nothing is allocated. The nodes are stored in the order of a walk through the whole tree, so that a
walk that leaves out the descendants of some nodes needs no stack.
"""

import math

from magmotor.numerics.constants import COUNT
from magmotor.numerics.deferred import subroutine

BEGIN, END, NEXT, CENTER, RADIUS, VALUES = 0, 1, 2, 3, 6, 7
"""Columns of a node: first block, last + 1, next node that is no descendant, box, and others."""


@subroutine
def build(nodes, order, points, count):
    """Sort the numbers of the points into blocks of eight, and write the nodes; return how many.

    `points` has rows x, y, z, and `order` receives the numbers of the first `count` columns. There
    are two nodes for each block, less one.
    """
    blocks = (count + COUNT - 1) // COUNT
    for i in range(count):
        order[i] = i
    nodes[0, BEGIN], nodes[0, END] = 0, blocks
    for k in range(2 * blocks - 1):
        begin, end = int(nodes[k, BEGIN]), int(nodes[k, END])
        nodes[k, NEXT] = k + 2 * (end - begin) - 1
        axis = _enclose(nodes[k], order, points, COUNT * begin, min(COUNT * end, count))
        if end - begin > 1:
            middle = (begin + end) // 2
            _select(order, points, axis, COUNT * begin, min(COUNT * end, count), COUNT * middle)
            near, far = k + 1, k + 2 * (middle - begin)
            nodes[near, BEGIN], nodes[near, END] = begin, middle
            nodes[far, BEGIN], nodes[far, END] = middle, end
    return 2 * blocks - 1


@subroutine
def _enclose(node, order, points, first, last):
    """Write the center of the points' box and their largest distance from it; return its axis."""
    axis, widest, radius = 0, -1.0, 0.0
    for d in range(3):
        low = high = points[d, order[first]]
        for i in range(first + 1, last):
            low, high = min(low, points[d, order[i]]), max(high, points[d, order[i]])
        node[CENTER + d] = 0.5 * (low + high)
        if high - low > widest:
            axis, widest = d, high - low
    for i in range(first, last):
        radius = max(radius, distance(node, points, order[i]))
    node[RADIUS] = radius
    return axis


@subroutine
def distance(node, points, i):
    """Return the distance of point i from the center of a node's box."""
    x = points[0, i] - node[CENTER]
    y = points[1, i] - node[CENTER + 1]
    z = points[2, i] - node[CENTER + 2]
    return math.sqrt(x * x + y * y + z * z)


@subroutine
def _select(order, points, axis, first, last, middle):
    """Reorder so that the numbers before `middle` have no larger coordinates than those after."""
    low, high = first, last - 1
    while low < high:
        pivot = points[axis, order[(low + high) // 2]]
        i, j = low, high
        while i <= j:
            while points[axis, order[i]] < pivot:
                i += 1
            while pivot < points[axis, order[j]]:
                j -= 1
            if i <= j:
                order[i], order[j] = order[j], order[i]
                i += 1
                j -= 1
        if middle <= j:
            high = j
        elif middle >= i:
            low = i
        else:
            return
