// SPDX-License-Identifier: MIT
//
// cilantro.io: reading and writing clouds, matrices and images.
export module cilantro.io;

export import cilantro.cloud;
export import :file_options;
export import :ply;
export import :pcd;
export import :las;
export import :posed_scan;
export import :ptx;
export import :e57;
export import :text;
export import :cloud_file;
export import :cloud_reader;
export import :matrix_file;
export import :image_file;
