// SPDX-License-Identifier: MIT
//
// cilantro.tiles: clouds that are larger than memory, as tiles in files.
export module cilantro.tiles;

export import cilantro.io;
export import :communicator;
export import :tile_step;
export import :tiled_cloud;
export import :write_tiles;
export import :write_clusters;
export import :for_each_tile;
export import :reduce_tiles;
export import :tile_statistics;
export import :compare_tiles;
export import :align_tiles;
export import :kmeans_tiles;
export import :ransac_tiles;
