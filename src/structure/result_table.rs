//! Results as people and programs read them: named, typed columns with units.

use serde_json::{Map, Number, Value};

/// The values of one column.
#[derive(Clone, Debug, PartialEq)]
pub enum ResultValues {
    /// Words.
    Text(Vec<Option<String>>),
    /// Whole numbers.
    Integer(Vec<Option<i64>>),
    /// Numbers.
    Number(Vec<Option<f64>>),
}

/// One column of results.
#[derive(Clone, Debug, PartialEq)]
pub struct ResultColumn {
    /// Name, with the unit as its suffix where there is one, such as `ape_translation_rmse_m`.
    pub name: String,
    /// Unit; `1` where there is none.
    pub unit: String,
    /// What the column says.
    pub meaning: String,
    /// One value for each row.
    pub values: ResultValues,
}

/// A table of results.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ResultTable {
    /// Name of the table.
    pub name: String,
    /// Columns, all of one length.
    pub columns: Vec<ResultColumn>,
}

impl ResultValues {
    /// Number of rows.
    #[must_use]
    pub fn len(&self) -> usize {
        match self {
            Self::Text(values) => values.len(),
            Self::Integer(values) => values.len(),
            Self::Number(values) => values.len(),
        }
    }

    /// Whether there is no row.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The value of a row as it is written in CSV and Markdown, numbers so that they read back as the same bits; empty where it is absent.
    #[must_use]
    pub fn text(&self, row: usize) -> String {
        match self {
            Self::Text(values) => values[row].clone().unwrap_or_default(),
            Self::Integer(values) => values[row].map(|value| value.to_string()).unwrap_or_default(),
            Self::Number(values) => values[row].map(|value| value.to_string()).unwrap_or_default(),
        }
    }

    fn json(&self, row: usize) -> Value {
        match self {
            Self::Text(values) => values[row].clone().map_or(Value::Null, Value::String),
            Self::Integer(values) => values[row].map_or(Value::Null, Value::from),
            Self::Number(values) => values[row].and_then(Number::from_f64).map_or(Value::Null, Value::Number),
        }
    }
}

impl ResultTable {
    /// A table without columns.
    #[must_use]
    pub fn new(name: &str) -> Self {
        Self { name: name.to_owned(), columns: Vec::new() }
    }

    /// The table with one more column of words.
    #[must_use]
    pub fn text<S: Into<String>>(
        self,
        name: &str,
        meaning: &str,
        values: impl IntoIterator<Item = Option<S>>,
    ) -> Self {
        let values = values.into_iter().map(|value| value.map(Into::into)).collect();
        self.with(name, "1", meaning, ResultValues::Text(values))
    }

    /// The table with one more column of whole numbers.
    #[must_use]
    pub fn integer(
        self,
        name: &str,
        unit: &str,
        meaning: &str,
        values: impl IntoIterator<Item = Option<i64>>,
    ) -> Self {
        self.with(name, unit, meaning, ResultValues::Integer(values.into_iter().collect()))
    }

    /// The table with one more column of numbers.
    #[must_use]
    pub fn number(
        self,
        name: &str,
        unit: &str,
        meaning: &str,
        values: impl IntoIterator<Item = Option<f64>>,
    ) -> Self {
        self.with(name, unit, meaning, ResultValues::Number(values.into_iter().collect()))
    }

    fn with(mut self, name: &str, unit: &str, meaning: &str, values: ResultValues) -> Self {
        debug_assert!(self.columns.is_empty() || values.len() == self.rows(), "{name}: another length");
        let (name, unit, meaning) = (name.to_owned(), unit.to_owned(), meaning.to_owned());
        self.columns.push(ResultColumn { name, unit, meaning, values });
        self
    }

    /// Number of rows: that of the shortest column.
    #[must_use]
    pub fn rows(&self) -> usize {
        self.columns.iter().map(|column| column.values.len()).min().unwrap_or(0)
    }

    /// Comma-separated values with a header, as RFC 4180 has them.
    #[must_use]
    pub fn to_csv(&self) -> String {
        let quoted = |text: &str| {
            if text.contains([',', '"', '\n', '\r']) {
                format!("\"{}\"", text.replace('"', "\"\""))
            } else {
                text.to_owned()
            }
        };
        let line = |cells: Vec<String>| cells.join(",") + "\n";
        let mut csv = line(self.columns.iter().map(|column| quoted(&column.name)).collect());
        for row in 0..self.rows() {
            csv += &line(self.columns.iter().map(|column| quoted(&column.values.text(row))).collect());
        }
        csv
    }

    /// A Markdown table, numbers to the right.
    #[must_use]
    pub fn to_markdown(&self) -> String {
        let escaped = |text: &str| text.replace('\\', "\\\\").replace('|', "\\|").replace('\n', " ");
        let line = |cells: Vec<String>| format!("| {} |\n", cells.join(" | "));
        let mut markdown = line(self.columns.iter().map(|column| escaped(&column.name)).collect());
        let rule = |column: &ResultColumn| match column.values {
            ResultValues::Text(_) => "---",
            _ => "--:",
        };
        markdown += &format!("|{}|\n", self.columns.iter().map(rule).collect::<Vec<_>>().join("|"));
        for row in 0..self.rows() {
            markdown += &line(self.columns.iter().map(|column| escaped(&column.values.text(row))).collect());
        }
        markdown
    }

    /// The rows as a list of JSON objects; what is absent or no number is null.
    #[must_use]
    pub fn to_json(&self) -> Value {
        let object = |row| {
            let members = self.columns.iter().map(|column| (column.name.clone(), column.values.json(row)));
            Value::Object(members.collect::<Map<_, _>>())
        };
        Value::Array((0..self.rows()).map(object).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table() -> ResultTable {
        ResultTable::new("errors")
            .text("name", "who", [Some("a,\"b\""), None])
            .integer("frames", "1", "how many", [Some(3), None])
            .number("rmse_m", "m", "how far", [Some(0.1), Some(f64::NAN)])
    }

    #[test]
    fn csv_quotes_what_would_break_it() {
        assert_eq!(table().to_csv(), "name,frames,rmse_m\n\"a,\"\"b\"\"\",3,0.1\n,,NaN\n");
    }

    #[test]
    fn markdown_has_a_line_for_each_row() {
        let markdown = ResultTable::new("x").text("a|b", "", [Some("c|d")]).to_markdown();
        assert_eq!(markdown, "| a\\|b |\n|---|\n| c\\|d |\n");
    }

    #[test]
    fn json_has_null_for_what_is_no_number() {
        let json = table().to_json();
        assert_eq!(json[0], serde_json::json!({"name": "a,\"b\"", "frames": 3, "rmse_m": 0.1}));
        assert!(json[1]["rmse_m"].is_null() && json[1]["name"].is_null());
    }
}
