// SPDX-License-Identifier: MIT
//
// The whole library: `import cilantro;` imports all modules below.
export module cilantro;

export import cilantro.eigen;
export import cilantro.core;
export import cilantro.numeric;
export import cilantro.search;
export import cilantro.geometry;
export import cilantro.cloud;
export import cilantro.io;
export import cilantro.tiles;
export import cilantro.features;
export import cilantro.registration;
export import cilantro.warp;
export import cilantro.clustering;
export import cilantro.consensus;
export import cilantro.spatial;
export import cilantro.embedding;
