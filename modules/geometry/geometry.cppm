// SPDX-License-Identifier: MIT
//
// cilantro.geometry: the shape of a set of points, locally and as a whole: normals, moments, grids,
// outliers, depth images, primitives.
export module cilantro.geometry;

export import cilantro.core;
export import cilantro.search;
export import :moments;
export import :covariance;
export import :principal_components;
export import :normals;
export import :orientation;
export import :gradients;
export import :outliers;
export import :sampling;
export import :groups;
export import :voxel_grid;
export import :accumulate;
export import :representatives;
export import :voxel_downsample;
export import :region;
export import :camera;
export import :depth_image;
export import :projection;
export import :contract;
export import :hyperplane;
export import :line;
export import :sphere;
export import :circle;
export import :cylinder;
