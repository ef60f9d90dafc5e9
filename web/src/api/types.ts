/** Short names of the API's schemas. */

import type { components } from './schema'

type Schemas = components['schemas']

export type JobSpec = Schemas['JobSpec']
/** A shipped robot by name, a variant of one, or the files of another robot. */
export type RobotSource = NonNullable<JobSpec['robot']>
export type TuningWorlds = Schemas['TuningWorlds']
export type JobState = Schemas['JobState']
export type JobSummary = Schemas['JobSummaryView']
/** A job whose spec and kind are null if the server cannot read them. */
export type StoredJob = Schemas['JobView']
export type Job = StoredJob & {
  readonly spec: AnySpec
  readonly kind: NonNullable<StoredJob['kind']>
}
export type Iteration = Schemas['IterationView']
export type Evaluation = Schemas['EvaluationView']
export type ScenarioResult = Schemas['ScenarioResultView']
export type Scenario = Schemas['Scenario']
export type Variable = Schemas['Variable']
export type Preference = Schemas['Preference']
export type PreferencePreset = Schemas['PreferenceView']
export type RobotPreset = Schemas['RobotView']
export type ScenarioPreset = Schemas['ScenarioView']
export type Controller = Schemas['ControllerView']
export type OptimizerPreset = Schemas['OptimizerView']
export type ReferenceView = Schemas['ReferenceView']
export type Verdict = Schemas['VerdictView']
export type QuantityChange = Schemas['QuantityView']
export type Simulation = Schemas['SimulationView']
export type HistoryVerification = Schemas['HistoryVerificationView']
export type Activity = Schemas['ActivityView']
export type DistributionItem = Schemas['DistributionItemView']
export type Ranking = Schemas['RankingView']
export type RankedDesign = Schemas['RankedDesignView']
export type Robustness = Schemas['RobustnessView']
export type RobustnessIndex = Schemas['IndexView']
export type Objective = Schemas['ObjectiveView']
export type IdentificationSpec = Schemas['IdentificationSpec']
export type CalibrationSpec = Schemas['CalibrationSpec']
export type CertificateSpec = Schemas['CertificateSpec']
export type PreferencesSpec = Schemas['PreferencesSpec']
export type AnySpec =
  | JobSpec
  | IdentificationSpec
  | CalibrationSpec
  | CertificateSpec
  | PreferencesSpec
export type CandidatePreferences = Schemas['CandidatePreferencesView']
export type CandidatePreference = Schemas['CandidatePreferenceView']
export type Certificate = Schemas['CertificateView']
export type ComparedEngine = Schemas['ComparedEngineView']
export type Compared = Schemas['ComparedView']
export type Spread = Schemas['SpreadView']
export type Proportion = Schemas['ProportionView']
export type World = Schemas['WorldView']
export type Influence = Schemas['InfluenceView']
export type Identifiability = Schemas['IdentifiabilityView']
export type Convergence = Schemas['ConvergenceView']
export type JobComparison = Schemas['JobComparisonView']
export type JobFacets = Schemas['JobFacetsView']
export type FittedParameter = Schemas['ParameterView']
export type Targets = Schemas['TargetsView']
export type TargetResult = Schemas['TargetResultView']
export type RecordingView = Schemas['RecordingView']
export type RecordingEntry = Schemas['RecordingEntryView']
export type MeasuredWalk = Schemas['MeasuredWalkView']
export type MeasuredWalkRequest = Schemas['MeasuredWalkRequest']
export type PluginCase = Schemas['CaseView']
export type Estimate = Schemas['EstimateView']
export type Front = Schemas['FrontView']
export type FrontDesign = Schemas['FrontDesignView']
export type FrontWinner = Schemas['FrontWinnerView']
export type PreferenceFor = Schemas['PreferenceForView']
export type PreferenceFit = Schemas['PreferenceFitView']
export type Importance = Schemas['ImportanceView']
export type VariableImportance = Schemas['VariableImportanceView']
export type ImportanceIndex = Schemas['IndexIntervalView']
export type Firmware = Schemas['FirmwareView']
export type RobotDraftRequest = Schemas['RobotDraftRequest']
export type RobotCheck = Schemas['RobotCheckView']
export type CheckedLeg = Schemas['CheckedLegView']
