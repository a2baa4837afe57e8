// SPDX-License-Identifier: MIT
export module cilantro.io:ptx;

import cilantro.standard;
import cilantro.core;
import cilantro.cloud;
import :file_options;
import :posed_scan;

namespace cilantro {

/// Reads the points of all scans of a PTX file, a text, in world coordinates.
///
/// Directions without an echo, 0 0 0, are left out; `read_ptx_scans` keeps them. Intensities become
/// the attribute intensity, in double; colours are from 0 to 255, and black in a scan without, if
/// others have them. Of several scans, an attribute scan numbers each point's, from 0. In two
/// dimensions, z is an attribute. Coordinates that S would round are treated as `origin_policy`
/// says.
///
/// Throws `io_error` with path and line for a file that is malformed or truncated. Memory is
/// bounded by the size of the file, whatever its counts claim.
export template <Scalar S, int D = 3>
  requires(D == 2 || D == 3)
[[nodiscard]] point_cloud<S, D> read_ptx(const std::filesystem::path& path,
                                         const read_options& options = {});

/// As above, from memory; errors refer to it as `name`.
export template <Scalar S, int D = 3>
  requires(D == 2 || D == 3)
[[nodiscard]] point_cloud<S, D> read_ptx(std::span<const std::byte> bytes,
                                         const std::filesystem::path& name = "memory",
                                         const read_options& options = {});

/// Reads each scan of a PTX file by itself, relative to its scanner, with its pose. The clouds are
/// organised, a column for each step of the scanner's turn; where there was no echo, points are
/// NaN. Throws as `read_ptx` does.
export template <Scalar S>
[[nodiscard]] std::vector<posed_scan<S>> read_ptx_scans(const std::filesystem::path& path,
                                                        const task_monitor& monitor = {});

}  // namespace cilantro
