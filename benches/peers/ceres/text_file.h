// Lines of numbers, with complaints that say where.
#pragma once

#include <fstream>
#include <sstream>
#include <stdexcept>
#include <string>

namespace peer {

// Reads a file line by line.
class TextFile {
 public:
  explicit TextFile(const std::string& path) : path_(path), file_(path) {
    if (!file_) throw std::runtime_error(path + ": cannot be opened");
  }

  // Whether there was another line; its first word is put into `kind`.
  bool Next(std::string* kind) {
    std::string line;
    while (std::getline(file_, line)) {
      ++number_;
      words_.clear();
      words_.str(line);
      if (words_ >> *kind && (*kind)[0] != '#') return true;
    }
    return false;
  }

  // The next number of the line.
  double Number() { return Read<double>("a number"); }

  // The next word of the line.
  std::string Word() { return Read<std::string>("a word"); }

  // The next number of the line as a place in a list of `size`.
  size_t Place(size_t size) {
    const long place = Read<long>("a place in a list");
    if (place < 0 || static_cast<size_t>(place) >= size) {
      Fail("expected a place below " + std::to_string(size) + "; found " + std::to_string(place));
    }
    return static_cast<size_t>(place);
  }

  // The next number of the line as a name.
  long Id() { return Read<long>("an id"); }

  [[noreturn]] void Fail(const std::string& what) const {
    throw std::runtime_error(path_ + " line " + std::to_string(number_) + ": " + what);
  }

 private:
  template <typename T>
  T Read(const char* expected) {
    T found;
    if (!(words_ >> found)) Fail(std::string("expected ") + expected);
    return found;
  }

  std::string path_;
  std::ifstream file_;
  std::istringstream words_;
  long number_ = 0;
};

}  // namespace peer
