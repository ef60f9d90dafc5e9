# Cycles of controller_tick: the first file is a disassembly, the second qemu's trace of a Cortex-M0, one
# instruction per line. Costs of the Cortex-M0 are from its technical reference manual, memory without
# wait states. The MSP430 has no 32-bit instructions: its cycles are estimated from the family's user's
# guide (SLAU144), each 32-bit operation as two of 16 bits.

function cost(of, taken, count) {
    m0 = 1; msp = 2
    if (of ~ /^ldr|^str/) {
        m0 = 2
        msp = of ~ /h|b/ ? 4 : 8
    } else if (of ~ /^(push|pop|ldm|stm)/) {
        m0 = 1 + count + (taken ? 3 : 0)
        msp = 6 * count + (taken ? 4 : 0)
    } else if (of ~ /^mul/) {
        msp = 46 # three multiplications of the hardware multiplier, of 14 each, and two sums of 32 bits
    } else if (of == "bl") {
        m0 = 4; msp = 5
    } else if (of ~ /^(bx|blx)/) {
        m0 = 3; msp = 5
    } else if (of ~ /^b/ && of !~ /^bic/) {
        m0 = taken ? 3 : 1; msp = 4
    } else if (of ~ /^(lsl|lsr|asr)/) {
        msp = 8
    }
}

FNR == NR {
    if ($2 ~ /^<.*>:$/) symbol[strtonum_hex($1)] = substr($2, 2, length($2) - 3)
    else if ($1 ~ /^[0-9a-f]+:$/) {
        at = strtonum_hex(substr($1, 1, length($1) - 1))
        name[at] = $2
        sub(/\.n$|\.w$/, "", name[at])
        rest = $0; registers[at] = gsub(/,/, "", rest) + 1
        wide[at] = $2 == "bl" ? 4 : 2
    }
    next
}

function strtonum_hex(text,  i, x) {
    x = 0
    for (i = 1; i <= length(text); i++) x = 16 * x + index("0123456789abcdef", substr(text, i, 1)) - 1
    return x
}

/^Trace/ {
    match($0, /\[[0-9a-f]+\/[0-9a-f]+/)
    split(substr($0, RSTART + 1, RLENGTH - 1), part, "/")
    pc = strtonum_hex(part[2])
    if (inside) {
        cost(name[before], pc != before + wide[before], registers[before])
        cycles += m0; other += msp; instructions++
    }
    if (symbol[pc] == "tick_done") inside = 0
    if (symbol[pc] == "controller_tick") {
        inside = 1; ticks++
    }
    before = pc
}

END {
    if (!ticks) { print "no trace of controller_tick" > "/dev/stderr"; exit 1 }
    printf "controller_tick, of %d traced samples on average:\n", ticks
    printf "%8d instructions of a Cortex-M0\n", instructions / ticks
    printf "%8d cycles of a Cortex-M0 (multiplications of one cycle, no wait states)\n", cycles / ticks
    printf "%8d cycles of an MSP430 with its 16-bit hardware multiplier, estimated\n", other / ticks
}
