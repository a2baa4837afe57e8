// SPDX-License-Identifier: MIT
export module cilantro.registration:combined_searcher;

import cilantro.standard;
import cilantro.core;
import :concepts;
import :correspondence;

namespace cilantro {

/// Combines one searcher per term of a metric: the pairs of the first searcher are for the first
/// term, and so on. Keeps copies of the searchers.
export template <class... Searchers>
class combined_searcher {
 public:
  template <class S>
  using pairs_type = std::array<correspondences<S>, sizeof...(Searchers)>;
  using memory = std::tuple<repeated_memory<Searchers>...>;

  explicit combined_searcher(Searchers... searchers) : searchers_{std::move(searchers)...} {}

  template <class T>
    requires(CorrespondenceSearcher<Searchers, T> && ...)
  void find(const T& transform, pairs_type<typename T::Scalar>& out) const {
    memory fresh;
    find(transform, fresh, out);
  }
  template <class T>
    requires(CorrespondenceSearcher<Searchers, T> && ...)
  void find(const T& transform, memory& known, pairs_type<typename T::Scalar>& out) const {
    [&]<std::size_t... I>(std::index_sequence<I...>) {
      (find_with_memory(std::get<I>(searchers_), transform, std::get<I>(known), out[I]), ...);
    }(std::index_sequence_for<Searchers...>{});
  }

 private:
  std::tuple<Searchers...> searchers_;
};

}  // namespace cilantro
