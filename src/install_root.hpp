// Where this copy of brume keeps its data: <folder of libbrume.so>/brume.
#pragma once

#include <string>

namespace brume {

std::string installRoot();

}  // namespace brume
