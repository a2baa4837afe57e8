// SPDX-License-Identifier: MIT
//
// cilantro.clustering: groups of points that belong together, by several algorithms, and scores of
// groupings.
export module cilantro.clustering;

export import cilantro.core;
export import cilantro.search;
export import cilantro.geometry;
export import :clusters;
export import :connected_components;
export import :dbscan;
export import :hdbscan;
export import :kmeans;
export import :kernel;
export import :mean_shift;
export import :spectral;
export import :scores;
export import :contract;
