// SPDX-License-Identifier: MIT
export module cilantro.core:indexed_iterator;

import cilantro.standard;

namespace cilantro {

/// The type of a copy of an element of `Source`: its `value_type`, if it has one.
template <class Source>
struct kept_element {
  using type = std::remove_cvref_t<decltype(std::declval<const Source&>()[std::ptrdiff_t{0}])>;
};
template <class Source>
  requires requires { typename Source::value_type; }
struct kept_element<Source> {
  using type = typename Source::value_type;
};

/// A random-access iterator over `source[0]`, `source[1]`, … It keeps its source by value, so
/// sources must be cheap to copy, as views and pointers are; an iterator then stays valid when its
/// range is moved.
export template <class Source>
class indexed_iterator {
 public:
  using reference = decltype(std::declval<const Source&>()[std::ptrdiff_t{0}]);
  using value_type = typename kept_element<Source>::type;
  using difference_type = std::ptrdiff_t;
  // Dereferencing may return a temporary, which the iterator categories before C++20 do not allow.
  using iterator_category = std::input_iterator_tag;
  using iterator_concept = std::random_access_iterator_tag;

  indexed_iterator() = default;
  indexed_iterator(Source source, difference_type i) : source_{std::move(source)}, i_{i} {}

  reference operator*() const { return source_[i_]; }
  reference operator[](difference_type n) const { return source_[i_ + n]; }

  indexed_iterator& operator+=(difference_type n) {
    i_ += n;
    return *this;
  }
  indexed_iterator& operator-=(difference_type n) { return *this += -n; }
  indexed_iterator& operator++() { return *this += 1; }
  indexed_iterator& operator--() { return *this -= 1; }
  indexed_iterator operator++(int) { return std::exchange(*this, *this + 1); }
  indexed_iterator operator--(int) { return std::exchange(*this, *this - 1); }
  friend indexed_iterator operator+(indexed_iterator a, difference_type n) { return a += n; }
  friend indexed_iterator operator+(difference_type n, indexed_iterator a) { return a += n; }
  friend indexed_iterator operator-(indexed_iterator a, difference_type n) { return a -= n; }
  friend difference_type operator-(const indexed_iterator& a, const indexed_iterator& b) {
    return a.i_ - b.i_;
  }
  friend bool operator==(const indexed_iterator& a, const indexed_iterator& b) {
    return a.i_ == b.i_;
  }
  friend auto operator<=>(const indexed_iterator& a, const indexed_iterator& b) {
    return a.i_ <=> b.i_;
  }

 private:
  Source source_ = {};
  difference_type i_ = 0;
};

/// The source of an `indexed_iterator` over the elements of `*all`, an object that stays where it
/// is.
export template <class Rows>
struct indexed_rows {
  const Rows* all = nullptr;  ///< The object.
  auto operator[](std::ptrdiff_t i) const { return (*all)[i]; }
};
template <class Rows>
indexed_rows(const Rows*) -> indexed_rows<Rows>;

}  // namespace cilantro
