// SPDX-License-Identifier: MIT
//
// What the tests share: spaces to run in, seeded points, files.
module;
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <vector>
export module test_support;

import cilantro;

export namespace test {

/// A scalar and a dimension; run-time dimensions are tried with 4.
template <class S, int D>
struct space {
  using scalar = S;
  static constexpr int static_dimension = D;
  static constexpr int dimension = D == cilantro::dynamic ? 4 : D;
};
using f2 = space<float, 2>;
using f3 = space<float, 3>;
using f5 = space<float, 5>;
using fx = space<float, cilantro::dynamic>;
using d2 = space<double, 2>;
using d3 = space<double, 3>;
using d5 = space<double, 5>;
using dx = space<double, cilantro::dynamic>;

/// Uses one target while it lives.
class using_target {
 public:
  explicit using_target(cilantro::vector_target target) { cilantro::use_vector_target(target); }
  using_target(const using_target&) = delete;
  using_target& operator=(const using_target&) = delete;
  ~using_target() { cilantro::use_vector_target(before_); }

 private:
  cilantro::vector_target before_ = cilantro::current_vector_target();
};

inline std::vector<cilantro::vector_target> available_targets() {
  std::vector<cilantro::vector_target> all;
  for (const auto t : {cilantro::vector_target::baseline, cilantro::vector_target::avx2,
                       cilantro::vector_target::avx512})
    if (cilantro::is_available(t)) all.push_back(t);
  return all;
}

template <class S>
inline constexpr S nan = std::numeric_limits<S>::quiet_NaN();
template <class S>
inline constexpr S infinity = std::numeric_limits<S>::infinity();

/// Uniform in the cube [low, high]^D.
template <class Space>
auto random_points(cilantro::index_t count, std::uint64_t seed = 0, double low = -1,
                   double high = 1) {
  cilantro::point_matrix<typename Space::scalar, Space::static_dimension> points(Space::dimension,
                                                                                 count);
  cilantro::random_stream random{seed};
  for (cilantro::index_t i = 0; i < count; ++i)
    for (cilantro::index_t d = 0; d < Space::dimension; ++d)
      points(d, i) = static_cast<typename Space::scalar>(random.uniform(low, high));
  return points;
}

/// The same size and the same bits, NaN included.
template <class A, class B>
bool same_bits(const A& a, const B& b) {
  if (a.rows() != b.rows() || a.cols() != b.cols()) return false;
  for (cilantro::index_t j = 0; j < a.cols(); ++j)
    for (cilantro::index_t i = 0; i < a.rows(); ++i)
      if (!(a(i, j) == b(i, j) || (std::isnan(a(i, j)) && std::isnan(b(i, j))))) return false;
  return true;
}

/// The inverse of a transform. Eigen's own takes seconds to compile for each type.
template <class T>
T inverse(const T& transform) {
  const auto d = transform.linear().rows();
  const Eigen::MatrixXd linear =
      *cilantro::solve(transform.linear().template cast<double>(), Eigen::MatrixXd::Identity(d, d));
  const Eigen::VectorXd translation = transform.translation().template cast<double>();
  return cilantro::make_transform<T>(linear, -(linear * translation).eval());
}

/// A file of the test data, which is not part of the project; nothing if it is not there.
std::optional<std::filesystem::path> data_file(const std::filesystem::path& name) {
  const char* set = std::getenv("CILANTRO_TEST_DATA");
  const auto path = std::filesystem::path{set ? set : CILANTRO_TEST_DATA} / name;
  if (!std::filesystem::exists(path)) return std::nullopt;
  return path;
}

/// A folder that is removed with everything in it.
class temporary_folder {
 public:
  temporary_folder() {
    std::string name = (std::filesystem::temp_directory_path() / "cilantro-XXXXXX").string();
    path_ = ::mkdtemp(name.data());
  }
  temporary_folder(const temporary_folder&) = delete;
  temporary_folder& operator=(const temporary_folder&) = delete;
  ~temporary_folder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  [[nodiscard]] const std::filesystem::path& path() const { return path_; }
  [[nodiscard]] std::filesystem::path operator/(std::string_view name) const {
    return path_ / name;
  }
  /// How many entries it has.
  [[nodiscard]] auto count() const {
    return std::distance(std::filesystem::directory_iterator{path_},
                         std::filesystem::directory_iterator{});
  }

 private:
  std::filesystem::path path_;
};

std::string read_file(const std::filesystem::path& path) {
  std::ifstream in{path, std::ios::binary};
  return {std::istreambuf_iterator<char>{in}, {}};
}

void write_file(const std::filesystem::path& path, std::string_view content) {
  std::ofstream{path, std::ios::binary} << content;
}

}  // namespace test
