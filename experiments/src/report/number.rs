//! Numbers as text: for people with a stated number of digits, for CSV with all of them.

/// Shortest text that reads back as the same number; whole numbers without a point.
pub(crate) fn exact(value: f64) -> String {
    if value == value.trunc() && value.abs() < 1e15 { format!("{:.0}", value + 0.0) } else { format!("{value:?}") }
}

/// `digits` significant digits, thousands apart by thin spaces; whole digits are never cut, and whole numbers get no point.
/// 0 stands for as many digits as the number has. Very large and very small numbers are written with a power of ten.
pub(crate) fn readable(value: f64, digits: u8) -> String {
    if digits == 0 {
        return readable(value, exact_digits(value));
    }
    if value == 0.0 {
        return "0".into();
    }
    let rounded = format!("{:.*e}", usize::from(digits) - 1, value);
    let Some((mantissa, Ok(exponent))) = rounded.split_once('e').map(|(m, e)| (m, e.parse::<i32>())) else {
        return rounded;
    };
    if !(-4..15).contains(&exponent) {
        return format!("{}×10{}", mantissa.replace('-', "−"), superscript(exponent));
    }
    let mut decimals = usize::try_from(i32::from(digits) - 1 - exponent).unwrap_or(0);
    if value == value.trunc() {
        decimals = 0;
    }
    let plain = format!("{:.decimals$}", value.abs());
    let (whole, fraction) = plain.split_once('.').map_or((plain.as_str(), None), |(w, f)| (w, Some(f)));
    let mut text = if value < 0.0 { "−".to_owned() } else { String::new() };
    for (i, digit) in whole.chars().enumerate() {
        if i > 0 && (whole.len() - i) % 3 == 0 && whole.len() > 4 {
            text.push('\u{2009}');
        }
        text.push(digit);
    }
    if let Some(fraction) = fraction {
        text.push('.');
        text += fraction;
    }
    text
}

/// At most two significant digits.
pub(crate) fn short(value: f64) -> String {
    readable(value, exact_digits(value).min(2))
}

/// How many significant digits read back as the same number.
fn exact_digits(value: f64) -> u8 {
    let mantissa = format!("{value:e}");
    let digits = mantissa.split('e').next().unwrap_or_default().bytes().filter(u8::is_ascii_digit).count();
    u8::try_from(digits).unwrap_or(17)
}

/// Mantissa with the digits it has, times a power of ten.
pub(crate) fn readable_power(value: f64) -> String {
    let text = format!("{value:e}").replace('-', "−");
    match text.split_once('e') {
        Some((mantissa, exponent)) => {
            format!("{mantissa}×10{}", superscript(exponent.replace('−', "-").parse().unwrap_or(0)))
        }
        None => text,
    }
}

fn superscript(exponent: i32) -> String {
    exponent
        .to_string()
        .chars()
        .map(|c| match c {
            '-' => '⁻',
            '1' => '¹',
            '2' => '²',
            '3' => '³',
            '0' => '⁰',
            digit => char::from_u32(0x2070 + u32::from(digit) - u32::from('0')).unwrap_or(digit),
        })
        .collect()
}

/// Bytes in the largest binary unit that keeps a whole part.
pub fn bytes(count: u64) -> String {
    let units = ["B", "KiB", "MiB", "GiB"];
    let mut value = count as f64;
    let mut unit = 0;
    while value >= 1024.0 && unit + 1 < units.len() {
        value /= 1024.0;
        unit += 1;
    }
    let digits = usize::from(unit > 0 && value < 10.0);
    format!("{value:.digits$} {}", units[unit])
}

/// A duration: milliseconds below a second, then seconds, then minutes.
pub fn duration(seconds: f64) -> String {
    match seconds {
        s if s < 0.0005 => "< 1 ms".into(),
        s if s < 1.0 => format!("{:.0} ms", s * 1e3),
        s if s < 10.0 => format!("{s:.1} s"),
        s if s < 120.0 => format!("{s:.0} s"),
        s => format!("{:.0} min", s / 60.0),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn readable_numbers_keep_the_stated_digits() {
        for (value, digits, text) in [
            (28.935, 3, "28.9"),
            (0.32967, 2, "0.33"),
            (60_000_000.0, 3, "60\u{2009}000\u{2009}000"),
            (1234.5, 2, "1234"),
            (-0.5, 2, "−0.50"),
            (-0.5, 0, "−0.5"),
            (1.6, 3, "1.60"),
            (64.9123, 4, "64.91"),
            (1000.0, 4, "1000"),
            (9.999, 2, "10"),
            (3.2e-9, 2, "3.2×10⁻⁹"),
            (0.0, 5, "0"),
        ] {
            assert_eq!(readable(value, digits), text);
        }
    }

    #[test]
    fn exact_numbers_read_back_bit_for_bit() {
        for value in [0.1, 1.0 / 3.0, 6e7, -0.0, 1e300, 5e-324, 0.7_f64.sqrt()] {
            assert_eq!(exact(value).parse::<f64>().unwrap().to_bits(), (value + 0.0).to_bits());
        }
        assert_eq!(exact(6e7), "60000000");
    }

    #[test]
    fn sizes_and_durations_are_short() {
        assert_eq!([bytes(999), bytes(1536), bytes(64 << 20)], ["999 B", "1.5 KiB", "64 MiB"]);
        assert_eq!(
            [duration(0.0), duration(0.25), duration(2.0), duration(600.0)],
            ["< 1 ms", "250 ms", "2.0 s", "10 min"]
        );
    }
}
