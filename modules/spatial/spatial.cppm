// SPDX-License-Identifier: MIT
//
// cilantro.spatial: convex polytopes and regions of space.
export module cilantro.spatial;

export import cilantro.core;
export import cilantro.geometry;
export import :polytope_data;
export import :convex_polytope;
export import :space_region;
export import :flat_hull;
export import :delaunay;
export import :concave_hull;
export import :oriented_box;
export import :enclosing_ball;
export import :contract;
