//! Answers the questions of one page, always the newest.

use std::sync::Arc;

use bench_dragon_geometry::dragon::Question;
use serde_json::{Value, json};

use super::edit::Edit;
use super::newest::Newest;
use super::page_question::PageQuestion;
use super::plan::{Plan, Touch};
use super::plan_folder::PlanFolder;
use super::study::Study;

/// Answers for one page.
pub(super) struct Answerer<'a> {
    pub(super) folder: Arc<PlanFolder>,
    pub(super) studies: &'a Newest<Study>,
    /// The text that a hand began to drag.
    base: Option<Plan>,
    /// The plan of the last answer, and its first contact.
    shown: Option<(Plan, Touch)>,
    /// The saved version, if it is drawn beside the plan.
    saved: Option<Plan>,
    /// The question that the present study answers.
    studied: Question,
}

impl<'a> Answerer<'a> {
    pub(super) fn new(folder: Arc<PlanFolder>, studies: &'a Newest<Study>) -> Self {
        Self { folder, studies, base: None, shown: None, saved: None, studied: Question::default() }
    }

    /// Answers the newest questions until the place is closed. `send` returns whether the page is still there.
    pub(super) fn answer_all(&mut self, questions: &Newest<PageQuestion>, mut send: impl FnMut(&Value) -> bool) {
        while let Some(question) = questions.take() {
            let answer = self.answer(question);
            if !send(&answer) {
                return;
            }
        }
    }

    fn answer(&mut self, question: PageQuestion) -> Value {
        let PageQuestion { number, text, edit, at_s, saved } = question;
        let is_new = saved.is_some();
        if let Some(saved) = saved {
            self.saved = if saved.is_empty() { None } else { self.plan(saved).ok() };
        }
        let answer = match text {
            Some(text) => self.study(number, text, edit.as_ref(), at_s),
            None => self.pose(number, at_s),
        };
        self.beside_saved(answer, is_new.then_some(number))
    }

    /// Adds the dragons of the saved version at the same time; its run, if that is new.
    fn beside_saved(&self, mut answer: Value, new: Option<u64>) -> Value {
        if let (Some(saved), Some(time_s)) = (&self.saved, answer["pose"]["time_s"].as_f64()) {
            answer["saved"] = json!({ "handles": saved.pose(time_s)["handles"] });
            if let Some(number) = new {
                answer["saved"]["run"] = saved.run(number);
            }
        }
        answer
    }

    /// The plan of a text, perhaps after an edit. What takes longer is studied afterwards.
    fn study(&mut self, number: u64, text: String, edit: Option<&Edit>, at_s: Option<f64>) -> Value {
        let plan = match edit {
            None => self.plan(text),
            Some(edit) => self.based(text).and_then(|base| {
                let edited = edit.apply(&base.text, &base.config)?;
                self.plan(edited)
            }),
        };
        match plan {
            Err(reason) => json!({ "type": "mistake", "number": number, "reason": reason }),
            Ok(plan) => {
                let touch = plan.quick_touch(self.shown.as_ref().map(|(plan, touch)| (plan, *touch)));
                let message = plan.message(number, touch, at_s);
                self.studied.cancel();
                self.studied = Question::default();
                let study = Study { number, plan: plan.clone(), touch, question: self.studied.clone() };
                self.studies.put(study, |_, newer| newer);
                self.shown = Some((plan, touch));
                message
            }
        }
    }

    /// The dragons at another time.
    fn pose(&self, number: u64, at_s: Option<f64>) -> Value {
        let Some((plan, _)) = &self.shown else {
            return json!({ "type": "mistake", "number": number, "reason": "there is no plan yet" });
        };
        let at_s = at_s.unwrap_or(plan.times_s()[1]);
        json!({ "type": "pose", "number": number, "pose": plan.pose(at_s) })
    }

    fn plan(&self, text: String) -> Result<Plan, String> {
        let config = self.folder.config(&text)?;
        Ok(Plan { text, config })
    }

    /// The plan of a text that is edited. While a hand drags, the text stays the same.
    fn based(&mut self, text: String) -> Result<Plan, String> {
        let known = [self.base.as_ref(), self.shown.as_ref().map(|(plan, _)| plan)].into_iter().flatten();
        let known = known.into_iter().find(|plan| plan.text == text).cloned();
        let plan = match known {
            Some(plan) => plan,
            None => self.plan(text)?,
        };
        self.base = Some(plan.clone());
        Ok(plan)
    }
}

impl Drop for Answerer<'_> {
    fn drop(&mut self) {
        self.studied.cancel();
    }
}
