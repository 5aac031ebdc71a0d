# find_package(bench_dragon) defines the targets bench_dragon::shared and bench_dragon::static.
get_filename_component(bench_dragon_prefix "${CMAKE_CURRENT_LIST_DIR}/../../.." ABSOLUTE)

foreach(kind IN ITEMS shared static)
  if(NOT TARGET bench_dragon::${kind})
    string(TOUPPER ${kind} KIND)
    add_library(bench_dragon::${kind} ${KIND} IMPORTED)
    set_target_properties(bench_dragon::${kind} PROPERTIES
      INTERFACE_INCLUDE_DIRECTORIES "${bench_dragon_prefix}/include")
  endif()
endforeach()

set_target_properties(bench_dragon::shared PROPERTIES
  IMPORTED_LOCATION "${bench_dragon_prefix}/lib/libbench_dragon_c.so"
  IMPORTED_SONAME "libbench_dragon_c.so.0")
set_target_properties(bench_dragon::static PROPERTIES
  IMPORTED_LOCATION "${bench_dragon_prefix}/lib/libbench_dragon_c.a"
  INTERFACE_LINK_LIBRARIES "gcc_s;util;rt;pthread;m;dl;c")
