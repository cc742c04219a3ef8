"""Recommendations: the method and timestep that the charts say reach an error cheapest."""

from magmotor.recommendation.choice import Recommendation, recommend

__all__ = ["Recommendation", "recommend"]
