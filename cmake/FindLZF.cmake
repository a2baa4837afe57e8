# liblzf, which comes without a file of its own for CMake: defines LZF::LZF.
find_path(LZF_INCLUDE_DIR lzf.h PATH_SUFFIXES liblzf)
find_library(LZF_LIBRARY lzf)
mark_as_advanced(LZF_INCLUDE_DIR LZF_LIBRARY)

include(FindPackageHandleStandardArgs)
# The installed package includes this file, while CMake looks for cilantro.
find_package_handle_standard_args(LZF REQUIRED_VARS LZF_LIBRARY LZF_INCLUDE_DIR NAME_MISMATCHED)
if(LZF_FOUND AND NOT TARGET LZF::LZF)
  add_library(LZF::LZF UNKNOWN IMPORTED)
  set_target_properties(LZF::LZF PROPERTIES
    IMPORTED_LOCATION ${LZF_LIBRARY} INTERFACE_INCLUDE_DIRECTORIES ${LZF_INCLUDE_DIR})
endif()
