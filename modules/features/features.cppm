// SPDX-License-Identifier: MIT
//
// cilantro.features: what the surface around a point looks like, wherever it lies.
export module cilantro.features;

export import cilantro.core;
export import cilantro.search;
export import cilantro.geometry;
export import :fpfh;
export import :iss_keypoints;
