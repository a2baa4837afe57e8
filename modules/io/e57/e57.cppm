// SPDX-License-Identifier: MIT
export module cilantro.io:e57;

import cilantro.standard;
import cilantro.core;
import cilantro.cloud;
import :file_options;
import :posed_scan;

namespace cilantro {

/// Reads the points of all scans of an E57 file in world coordinates.
///
/// Coordinates may be cartesian or spherical; points that the file calls invalid are left out.
/// Colours are scaled by the limits that the scan tells, or else by those of their type. Every
/// other value becomes an attribute, such as intensity, row_index, column_index, return_index,
/// time_stamp: integers in the smallest type that holds their limits, others as float or double. A
/// scan without a value that others have is black, 0, or NaN there. Of several scans, an attribute
/// scan numbers each point's, from 0. In two dimensions, z is an attribute. Coordinates that S
/// would round are treated as `origin_policy` says. Pictures, and values that are texts, are not
/// read.
///
/// Throws `io_error` with path and byte for a file that is malformed or truncated, and names the
/// page whose checksum does not fit. Memory is bounded by the size of the file, whatever its counts
/// claim.
export template <Scalar S, int D = 3>
  requires(D == 2 || D == 3)
[[nodiscard]] point_cloud<S, D> read_e57(const std::filesystem::path& path,
                                         const read_options& options = {});

/// As above, from memory; errors refer to it as `name`.
export template <Scalar S, int D = 3>
  requires(D == 2 || D == 3)
[[nodiscard]] point_cloud<S, D> read_e57(std::span<const std::byte> bytes,
                                         const std::filesystem::path& name = "memory",
                                         const read_options& options = {});

/// Reads each scan of an E57 file by itself, relative to its scanner, with its name and pose.
/// Throws as `read_e57` does.
export template <Scalar S>
[[nodiscard]] std::vector<posed_scan<S>> read_e57_scans(const std::filesystem::path& path,
                                                        const task_monitor& monitor = {});

}  // namespace cilantro
