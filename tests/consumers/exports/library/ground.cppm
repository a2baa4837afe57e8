// SPDX-License-Identifier: MIT
export module ground;
export import cilantro;

export cilantro::point_cloud<float, 3> without_ground(const cilantro::point_cloud<float, 3>& scan);
