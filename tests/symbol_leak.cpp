// What check_symbols.sh must find: an inline function without an ISA in its name that leaves a
// copy, and code for a newer CPU than the baseline.
inline float leaked(const float* values) {
    float sum = 0.0f;
    for (int i = 0; i < 8; ++i) sum += values[i];
    return sum;
}

using Leak = float (*)(const float*);
Leak address_of_leaked() { return &leaked; }
