// SPDX-License-Identifier: MIT
export module cilantro.io:matrix_file;

import cilantro.standard;
import cilantro.core;

namespace cilantro {

/// A matrix of any size.
export template <Scalar S>
using any_matrix = Eigen::Matrix<S, dynamic, dynamic>;

/// Reads a matrix from NumPy's binary format (NPY, versions 1 to 3) if the file begins as one;
/// otherwise from text with one row per line, values separated by white space, commas or
/// semicolons. Lines that begin with # are skipped.
///
/// Integers and floating-point numbers of any size and byte order are converted to S. A
/// one-dimensional array becomes a column, a single number a 1 × 1 matrix. Points that NumPy stores
/// as N × Dim must be transposed to be points here. Throws `io_error` with path and position for
/// other contents, for rows of different lengths, and for truncated files. Memory is bounded by the
/// size of the file. Source: NumPy enhancement proposal 1, "A simple file format for NumPy arrays".
export template <Scalar S>
[[nodiscard]] any_matrix<S> read_matrix(const std::filesystem::path& path,
                                        const task_monitor& monitor = {});
/// As above, from memory; errors refer to it as `name`.
export template <Scalar S>
[[nodiscard]] any_matrix<S> read_matrix(std::span<const std::byte> bytes,
                                        const std::filesystem::path& name = "memory",
                                        const task_monitor& monitor = {});

/// How `write_matrix` writes a matrix: as `text`, or in NumPy's binary format, `npy`.
export enum class matrix_format { text, npy };

template <Scalar S>
void closed_write_matrix(const Eigen::Ref<const any_matrix<S>>& matrix,
                         const std::filesystem::path& path, matrix_format format,
                         const task_monitor& monitor);

/// Writes a matrix without loss, as text or in NumPy's binary format, with its rows and columns as
/// they are. The file appears under its name when it is complete, as with `write_ply`. Throws
/// `io_error`.
export template <class M>
  requires Scalar<typename M::Scalar>
void write_matrix(const Eigen::MatrixBase<M>& matrix, const std::filesystem::path& path,
                  matrix_format format = matrix_format::npy, const task_monitor& monitor = {}) {
  closed_write_matrix<typename M::Scalar>(any_matrix<typename M::Scalar>{matrix}, path, format,
                                          monitor);
}

}  // namespace cilantro
